"""`mosaic plugin check` says which rung a plugin stands on, and what its author does to get higher."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner, Result

from mosaic_core.cli.main import app
from mosaic_core.testing.pytest_plugin import InstallDistribution

GOOD = '''
from mosaic_core import DataChannelConfigurer, NoParams
from mosaic_core import DataChannelSendable, Message

class Beat(Message):
    count: int

class Heart(DataChannelSendable[Beat]):
    def messages(self):
        for count in self.every(0.1):
            yield Beat(count=count)

class HeartConfigurer(DataChannelConfigurer[NoParams]):
    """Beats."""
    connector_type = "acme-heart"
    def configure(self):
        return Heart(self.label)
'''
METADATA = {"License-Expression": "MIT", "Requires-Python": ">=3.11"}
BODY = "# acme-heart\n"


def squeezed(text: str) -> str:
    """Without the places where a table folds its lines."""
    return "".join(text.split())


def check(*words: str) -> Result:
    return CliRunner().invoke(app, ["plugin", "check", *words])


def install(install_distribution: InstallDistribution, source: str = GOOD) -> None:
    folder = install_distribution(
        "acme-heart",
        modules={"acme_heart.body": source, "acme_heart.__init__": ""},
        entry_points={"mosaic.connectors": {"acme-heart": "acme_heart.body:HeartConfigurer"}},
        metadata=METADATA,
        description=BODY,
    )
    (folder / "acme_heart" / "py.typed").touch()


def test_a_level_that_is_reached_is_0(install_distribution: InstallDistribution) -> None:
    install(install_distribution)
    done = check("acme-heart")
    assert done.exit_code == 0, done.output
    assert "acme-heart 1.0.0: bronze (or higher: --level gold asks for all)" in done.output


def test_what_can_not_be_judged_is_not_reached(install_distribution: InstallDistribution) -> None:
    install(install_distribution)
    done = check("acme-heart", "--level", "silver")
    assert done.exit_code == 1
    assert (
        "acme-heart: no source tree is at hand: name the folder of the plugin; not judged: tests-with-kit"
        in done.output
    )
    assert "acme-heart 1.0.0: bronze (silver was asked for)" in done.output


def test_a_failing_rule_is_told_with_file_line_reason_and_cure(install_distribution: InstallDistribution) -> None:
    install(install_distribution, GOOD.replace('    """Beats."""\n', ""))
    done = check("acme-heart")
    assert done.exit_code == 1
    assert squeezed("acme_heart/body.py:13: HeartConfigurer has no docstring") in squeezed(done.output)
    assert "why:  It is all that" in done.output
    assert "cure: Write one line below the class" in done.output
    assert "acme-heart 1.0.0: below bronze (bronze was asked for)" in done.output


def test_an_import_error_comes_with_its_traceback(install_distribution: InstallDistribution) -> None:
    install(install_distribution, f"import no_such_module_at_all\n{GOOD}")
    done = check("acme-heart")
    told = "acme_heart/body.py:1: importing acme_heart.body:HeartConfigurer raises ModuleNotFoundError"
    assert squeezed(told) in squeezed(done.output)
    assert squeezed(done.output).count("notjudged:is-a-configurer") == 1
    assert "Traceback (most recent call last)" in done.output
    assert "importlib" not in done.output


@pytest.mark.parametrize(("words", "has_trace"), [((), False), (("--traceback",), True)])
def test_other_errors_have_theirs_when_it_is_asked_for(
    install_distribution: InstallDistribution, words: tuple[str, ...], has_trace: bool
) -> None:
    install(install_distribution, GOOD.replace("return Heart(self.label)", "return Heart(1 / 0)"))
    done = check("acme-heart", *words)
    told = "acme_heart/body.py:17: with the params of its example it raises ZeroDivisionError"
    assert squeezed(told) in squeezed(done.output)
    assert ("Traceback" in done.output) is has_trace


def test_programs_get_a_finding_a_line_and_the_sum(install_distribution: InstallDistribution) -> None:
    install(install_distribution, GOOD.replace('    """Beats."""\n', ""))
    *lines, last = map(json.loads, check("acme-heart", "--json").stdout.splitlines())
    failed = [line for line in lines if line["verdict"] == "failed"]
    assert [(line["rule"], line["level"], line["subject"]) for line in failed] == [
        ("docstring", "bronze", "acme-heart")
    ]
    assert failed[0]["faults"][0]["place"]["line"] == 13
    assert failed[0]["cure"].startswith("Write one line")
    assert last == {
        "distribution": "acme-heart", "version": "1.0.0", "asked": "bronze", "reached": None, "is_reached": False,
    }  # fmt: skip


def test_a_name_that_nobody_knows_is_a_mistake_of_the_words() -> None:
    done = check("mosaic-camra")
    assert done.exit_code != 0
    assert "mosaic-camera" in str(done.exception.cure)  # type: ignore[union-attr]


WHEELS = """
from mosaic_core import DataChannelConfigurer, DataChannelReceivable, Message, NoParams

class Turn(Message):
    speed_mps: float

class Wheel(DataChannelReceivable[Turn]):
    timeout_s = 0.3
    motion_fields = ("speed_mps",)
    def handle_data(self, data): pass

class LeftConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "left"
    def configure(self): return Wheel(self.label)

class RightConfigurer(LeftConfigurer):
    connector_type = "right"
"""


@pytest.mark.parametrize(
    ("source", "mistake"),
    [
        (WHEELS, "Wheel: timeout_s is set, and after it nothing would happen: make_safe is not written."),
        (WHEELS.replace("timeout_s = 0.3", "").replace('("speed', '("sped'), "Wheel: motion_fields names 'sped_mps'"),
    ],
)
def test_a_mistake_of_a_class_is_told_once_with_its_line_and_none_of_the_frameworks(
    install_distribution: InstallDistribution, source: str, mistake: str
) -> None:
    points = {"left": "acme_wheels:LeftConfigurer", "right": "acme_wheels:RightConfigurer"}
    install_distribution("acme-wheels", modules={"acme_wheels": source}, entry_points={"mosaic.connectors": points})
    told = squeezed(check("acme-wheels").output)
    assert told.count(squeezed(mistake)) == 1
    assert "loads,left,right:" in told
    assert "acme_wheels.py:7:Wheel:" in told
    assert "declarations.py" not in told
    assert "raisesMosaicError" not in told
