"""The command line: exit codes, errors without tracebacks, and nothing heavy loaded for light commands."""

from __future__ import annotations

import json
import stat
import subprocess
import sys
from collections.abc import Callable
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any

import pytest
import yaml

from mosaic_core import __version__
from mosaic_core.cli import main as command_line
from mosaic_core.cli.later_command import LaterCommand
from mosaic_core.testing.pytest_plugin import InstallDistribution

Mosaic = Callable[..., Any]
HEAVY = ("aiortc", "av", "cv2", "numpy", "fastapi", "sqlalchemy", "httpx")


def test_the_version_is_shown(mosaic: Mosaic) -> None:
    assert mosaic("--version").out == f"mosaic-core {__version__}\n"


def test_the_help_names_own_commands_and_those_of_others(mosaic: Mosaic) -> None:
    shown = mosaic("--help")
    assert shown.code == 0
    for word in ("run", "validate", "connectors", "config", "operator", "server"):
        assert word in shown.out


@pytest.mark.parametrize("words", [(), ("operator",), ("run",), ("plugin", "new"), ("demo",)])
def test_a_usage_error_advises_an_option_that_is_there(mosaic: Mosaic, words: tuple[str, ...]) -> None:
    refused = mosaic(*words, "--nonsense")
    (advised,) = [line for line in refused.err.splitlines() if line.startswith("Try ")]
    shown = mosaic(*advised.split("'")[1].split()[1:])
    assert (shown.code, shown.out.split()[0]) == (0, "Usage:"), advised


def test_what_the_list_says_of_a_command_is_how_its_own_help_begins() -> None:
    for name, place, line in command_line.COMMANDS:
        command = LaterCommand(EntryPoint(name, f"mosaic_core.cli.{place}", ""), line).loaded()
        assert command.name == name
        assert " ".join((command.help or "").split()).startswith(line.removesuffix("."))


@pytest.mark.parametrize("command", sorted(entry_points(group="mosaic.commands").names))
def test_a_command_of_a_plugin_offers_completion_no_second_time(command: str, mosaic: Mosaic) -> None:
    shown = mosaic(command, "--help")
    assert shown.code == 0
    assert "completion" not in shown.out


@pytest.mark.parametrize("words", [("nonsense",), ("validate", "--nonsense"), ("connectors", "show")])
def test_wrong_words_are_usage_errors(mosaic: Mosaic, words: tuple[str, ...]) -> None:
    assert mosaic(*words).code == 2


@pytest.mark.parametrize(
    "words",
    [
        ["--help"],
        ["--version"],
        ["validate", "ROBOT"],
        ["connectors", "list"],
        ["config", "schema"],
        ["operator", "--help"],
    ],
)
def test_light_commands_load_nothing_heavy(words: list[str], robot_yaml: Path) -> None:
    words = [str(robot_yaml) if word == "ROBOT" else word for word in words]
    heavy = HEAVY if words[0] != "config" else ("aiortc", "av")  # asks every installed plugin for its params
    code = (
        "import sys\nfrom mosaic_core.cli.main import main\n"
        f"try:\n    main({words!r})\nexcept SystemExit as end:\n    assert not end.code\n"
        f"print([name for name in {heavy!r} if name in sys.modules], file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert done.stderr.splitlines()[-1] == "[]"


# -- validate ------------------------------------------------------------------------------------------------------


STRANGE = r"a\n--> forged:1\x1b[31m\u202e\U000e0041"
"""As YAML and the terminal spell it: an end of a line, an order, a mark of direction, a character that is not seen."""


@pytest.mark.parametrize(
    "connector",
    [
        f'{{type: "{STRANGE}", label: x}}',
        f'{{type: test-pattern, label: "{STRANGE}"}}',
        f'{{type: test-pattern, label: x, "{STRANGE}": 1}}',
        f'{{type: test-pattern, label: x, params: {{"{STRANGE}": 1}}}}',
        f'{{type: test-pattern, label: x, params: {{fps: "{STRANGE}"}}}}',
        f'{{type: test-pattern, label: x, safety: {{resource: "{STRANGE}"}}}}',
        f'{{type: test-pattern, label: x, delivery: {{mode: "{STRANGE}"}}}}',
    ],
    ids=["type", "label", "key", "key of params", "value", "resource", "delivery"],
)
def test_what_a_strangers_file_says_begins_no_line_and_gives_the_terminal_no_order(
    mosaic: Mosaic, robot_yaml: Path, connector: str
) -> None:
    robot_yaml.write_text(f"connectors:\n  - {connector}\n")
    said = mosaic("validate", str(robot_yaml)).err
    assert "error: " in said
    assert not [line for line in said.splitlines() if line.startswith("--> forged")]
    assert all(line.isprintable() for line in said.split("\n"))


def test_a_valid_file_is_said_to_be_so(mosaic: Mosaic, robot_yaml: Path) -> None:
    done = mosaic("validate", str(robot_yaml))
    assert (done.code, done.out, done.err) == (0, f"{robot_yaml}: valid\n", "")
    assert json.loads(mosaic("validate", str(robot_yaml), "--json").out) == {
        "valid": True, "problems": [], "hints": [], "leases": {},
    }  # fmt: skip


def test_mistakes_are_shown_with_their_line_and_cure(mosaic: Mosaic, robot_yaml: Path) -> None:
    robot_yaml.write_text(robot_yaml.read_text().replace("connection-check", "conection-check"))
    done = mosaic("validate", str(robot_yaml))
    assert done.code == 2
    assert done.out == ""
    lines = done.err.splitlines()
    assert lines[0] == "error: connectors[0].type: no connector type 'conection-check'"
    assert lines[1] == f"  --> {robot_yaml}:6  [config.unknown_type]"
    assert lines[2] == "     6 |   - { type: conection-check, label: link }"
    assert lines[3].startswith("       = did you mean 'connection-check'?")
    assert lines[-1] == "1 mistake; nothing was started"


def test_mistakes_as_json(mosaic: Mosaic, robot_yaml: Path) -> None:
    robot_yaml.write_text(robot_yaml.read_text().replace("label: link", "label: _link, parms: {}"))
    done = mosaic("validate", str(robot_yaml), "--json")
    assert done.code == 2
    result = json.loads(done.out)
    assert result["valid"] is False
    assert [(one["path"], one["line"]) for one in result["problems"]] == [
        ("connectors[0].label", 6),
        ("connectors[0].parms", 6),
    ]


def test_what_is_no_file_is_told_alike(mosaic: Mosaic, tmp_path: Path) -> None:
    done = mosaic("validate", str(tmp_path / "none.yaml"))
    assert done.code == 2
    assert "can't be read: No such file or directory" in done.err
    assert json.loads(mosaic("validate", str(tmp_path / "none.yaml"), "--json").out)["valid"] is False


def test_tokens_in_the_file_are_not_shown(mosaic: Mosaic, robot_yaml: Path) -> None:
    text = robot_yaml.read_text().replace("{ type: no-auth", "{ params: { token: 'hush' }, typ: 3, type: no-auth")
    robot_yaml.write_text(text)
    done = mosaic("validate", str(robot_yaml))
    assert "hush" not in done.err
    assert "token: ***" in done.err


def test_missing_variables_may_be_forgiven(mosaic: Mosaic, robot_yaml: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("LABEL", raising=False)
    robot_yaml.write_text(robot_yaml.read_text().replace("label: link", "label: ${LABEL}"))
    assert mosaic("validate", str(robot_yaml)).code == 2
    assert mosaic("validate", str(robot_yaml), "--allow-missing-env").code == 0
    assert mosaic("run", str(robot_yaml)).code == 2


BASE = """\
  - type: cmd-vel
    label: base
    params: { drive: { type: log } }
    safety: SAFETY
"""


@pytest.mark.parametrize(
    ("safety", "path", "cure"),
    [
        ("{ limits: { linear.X: { max: 1 } } }", "connectors[1].safety.limits.linear.X", "did you mean 'linear.x'?"),
        ("{ requires_lease: false, resource: arm }", "connectors[1].safety.resource", "add `requires_lease: true`"),
    ],
)
@pytest.mark.parametrize("robot_id", ["7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11", "${ROBOT_ID}"])
def test_what_a_start_refuses_is_refused_before(
    mosaic: Mosaic, robot_yaml: Path, safety: str, path: str, cure: str, robot_id: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("ROBOT_ID", raising=False)
    text = robot_yaml.read_text() + BASE.replace("SAFETY", safety)
    robot_yaml.write_text(text.replace("7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11", robot_id))
    done = mosaic("validate", str(robot_yaml), "--allow-missing-env", "--json")
    assert done.code == 2
    (problem,) = json.loads(done.out)["problems"]
    assert (problem["path"], problem["line"]) == (path, 10)
    assert cure in problem["cure"]
    if "$" not in robot_id:
        assert path in mosaic("run", str(robot_yaml)).err


def test_the_connectors_of_each_lease_are_told_and_a_slip_of_the_finger_is_seen(
    mosaic: Mosaic, robot_yaml: Path
) -> None:
    def leased(label: str, safety: str) -> str:
        return BASE.replace("base", label).replace("SAFETY", safety)

    whole = robot_yaml.read_text() + leased("wheels", "{}") + leased("lift", "{}")
    robot_yaml.write_text(whole)
    assert "lease" not in mosaic("validate", str(robot_yaml)).out
    robot_yaml.write_text(whole + leased("elbow", "{ resource: arm }") + leased("wrist", "{ resource: amr }"))
    done = mosaic("validate", str(robot_yaml))
    assert (done.code, done.out.splitlines()[:3]) == (
        0,
        ["lease 'motion': wheels, lift", "lease 'arm': elbow", "lease 'amr': wrist"],
    )
    result = json.loads(mosaic("validate", str(robot_yaml), "--json").out)
    assert result["leases"] == {"motion": ["wheels", "lift"], "arm": ["elbow"], "amr": ["wrist"]}
    (slip,) = [one for one in result["hints"] if "two leases" in one["message"]]
    assert (slip["path"], slip["line"]) == ("connectors[4].safety.resource", 22)
    assert slip["cure"].startswith("did you mean 'arm'?")


def test_a_label_from_the_environment_is_told_as_it_was_written(
    mosaic: Mosaic, robot_yaml: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SECRET", "hunter2")
    base = BASE.replace("label: base", "label: '${SECRET}'").replace("SAFETY", "{}")
    robot_yaml.write_text(robot_yaml.read_text() + base)
    done = mosaic("validate", str(robot_yaml), "--json")
    assert json.loads(done.out)["leases"] == {"motion": ["${SECRET}"]}
    assert "hunter2" not in done.out


ALIASED = """
from pydantic import Field
from mosaic_core import *

class Turn(Message):
    speed: float = Field(default=0.0, validation_alias="v")
    model_config = {"populate_by_name": True}

class Wheel(DataChannelReceivable[Turn]):
    requires_lease = True
    motion_fields = ("speed",)
    def handle_data(self, data): ...

class WheelConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "wheel"
    def configure(self):
        return Wheel(self.label)

class Stuck(DataChannelConfigurer[NoParams]):
    connector_type = "stuck"
    def configure(self):
        raise RuntimeError("no wheel")
"""


def test_mistakes_of_all_handlers_are_told_in_the_order_of_the_file_and_then_of_the_code(
    mosaic: Mosaic, robot_yaml: Path, install_distribution: InstallDistribution
) -> None:
    points = {"mosaic.connectors": {"wheel": "acme_wheel:WheelConfigurer", "stuck": "acme_wheel:Stuck"}}
    install_distribution("acme-wheel", modules={"acme_wheel": ALIASED}, entry_points=points)
    more = "  - { type: stuck, label: stuck }\n  - { type: wheel, label: wheel }\n  - { type: wheel, label: _no }\n"
    robot_yaml.write_text(robot_yaml.read_text() + more)
    problems = json.loads(mosaic("validate", str(robot_yaml), "--json").out)["problems"]
    *in_file, of_code = problems
    assert [one["line"] for one in in_file] == [8, 9]
    assert "no wheel" in of_code["message"]
    assert (of_code["path"], Path(of_code["file"]).name) == ("connectors[1]", "acme_wheel.py")
    assert "'speed' of the messages of connector 'wheel' can be written under two names" in problems[0]["message"]


def test_a_connector_with_a_value_that_only_the_robot_knows_is_not_made(
    mosaic: Mosaic, robot_yaml: Path, install_distribution: InstallDistribution, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("PORT", raising=False)
    module = GAUGE.replace(
        "        return Gauge", "        assert self.params.port == '/dev/gauge'\n        return Gauge"
    )
    install_distribution("acme-gauge", modules={"acme_gauge": module}, entry_points=GAUGE_POINT)
    gauge = "  - { type: gauge, label: gauge, params: { port: '${PORT}' } }\n"
    robot_yaml.write_text(robot_yaml.read_text() + gauge)
    assert mosaic("validate", str(robot_yaml), "--allow-missing-env").code == 0
    monkeypatch.setenv("PORT", "/dev/other")
    assert mosaic("validate", str(robot_yaml), "--allow-missing-env").code == 2


# -- connectors ----------------------------------------------------------------------------------------------------


def test_connectors_are_listed_with_their_origin(mosaic: Mosaic) -> None:
    rows = [line for line in mosaic("connectors", "list").out.splitlines() if line.startswith("connection-check ")]
    assert rows[0].split()[-2:] == ["mosaic-core", __version__]
    listed = json.loads(mosaic("connectors", "list", "--json").out)
    assert {one["type"] for one in listed} >= {"connection-check"}


def test_a_connector_is_shown_with_an_example_to_paste(
    mosaic: Mosaic, install_distribution: InstallDistribution
) -> None:
    install_distribution("acme-gauge", modules={"acme_gauge": GAUGE}, entry_points=GAUGE_POINT)
    shown = mosaic("connectors", "show", "gauge")
    assert shown.code == 0
    assert "gauge  (acme-gauge 1.0.0)\nReads a gauge." in shown.out
    assert [line.split() for line in shown.out.splitlines() if line.startswith("period_s")] == [
        ["period_s", "number", ">", "0", "1.0", "s", "Between", "readings."]
    ]
    (example,) = yaml.safe_load(shown.out.partition("Example:\n")[2])
    assert example == {
        "type": "gauge",
        "label": "gauge",
        "params": {"port": "…", "period_s": 1.0, "mode": "fast", "bus": {"address": 3}},
    }
    shown = json.loads(mosaic("connectors", "show", "gauge", "--json").out)
    assert shown["params"]["required"] == ["port"]
    assert shown["example"] == example


def test_an_unknown_connector_is_a_usage_error_with_the_nearest_name(mosaic: Mosaic) -> None:
    shown = mosaic("connectors", "show", "connection-chek")
    assert shown.code == 2
    assert "error: no connector type 'connection-chek'" in shown.err
    assert "did you mean 'connection-check'?" in shown.err


def test_a_broken_plugin_is_listed_and_only_its_use_is_an_error(
    mosaic: Mosaic, install_distribution: InstallDistribution
) -> None:
    install_distribution("acme-broken", entry_points={"mosaic.connectors": {"broken": "acme_no_module:X"}})
    assert "acme-broken" in mosaic("connectors", "list").out
    shown = mosaic("connectors", "show", "broken")
    assert shown.code == 2
    assert "of acme-broken 1.0.0 can't be used: its entry point names the module 'acme_no_module'" in shown.err
    assert "Traceback" not in shown.err


def test_a_plugin_that_names_a_module_alone_is_listed_beside_the_others(
    mosaic: Mosaic, install_distribution: InstallDistribution
) -> None:
    points = {"mosaic.connectors": {"alone": "acme_alone"}}
    install_distribution("acme-alone", entry_points=points, modules={"acme_alone": "class Alone: ..."})
    listed = mosaic("connectors", "list")
    assert (listed.code, "acme-alone" in listed.out, "cmd-vel" in listed.out) == (0, True, True)


GAUGE_POINT = {"mosaic.connectors": {"gauge": "acme_gauge:GaugeConfigurer"}}
GAUGE = '''
from typing import Literal
from pydantic import BaseModel, Field
from mosaic_core import *

class Bus(Params):
    address: int = 3

class GaugeParams(Params):
    port: str
    period_s: float = Field(default=1.0, gt=0, description="Between readings.")
    mode: Literal["fast", "slow"] = "fast"
    bus: Bus = Bus()

class Gauge(DataChannelSendable[str]):
    pass

class GaugeConfigurer(DataChannelConfigurer[GaugeParams]):
    """Reads a gauge."""
    connector_type = "gauge"
    connector_type = "gauge"
    def configure(self):
        return Gauge(self.label)
'''

# -- config --------------------------------------------------------------------------------------------------------


def test_the_written_file_validates_and_is_private(
    mosaic: Mosaic, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "mosaic_config.yaml"
    assert mosaic("config", "init", str(path)).code == 0
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert mosaic("validate", str(path), "--allow-missing-env").code == 0
    monkeypatch.setenv("MOSAIC_ROBOT_ID", "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11")
    monkeypatch.setenv("MOSAIC_TOKEN", "t")
    assert mosaic("validate", str(path)).code == 0


def test_a_file_is_replaced_only_by_force(mosaic: Mosaic, robot_yaml: Path) -> None:
    before = robot_yaml.read_text()
    done = mosaic("config", "init", str(robot_yaml))
    assert (done.code, robot_yaml.read_text()) == (2, before)
    assert "--force" in done.err
    assert mosaic("config", "init", str(robot_yaml), "--force").code == 0
    assert robot_yaml.read_text() != before


def test_a_file_that_cannot_be_written_is_named(mosaic: Mosaic, tmp_path: Path) -> None:
    done = mosaic("config", "init", str(tmp_path / "no" / "folder.yaml"))
    assert done.code == 2
    assert "can't be written: No such file or directory" in done.err


def test_the_schema_knows_every_installed_connector(mosaic: Mosaic, install_distribution: InstallDistribution) -> None:
    install_distribution("acme-gauge", modules={"acme_gauge": GAUGE}, entry_points=GAUGE_POINT)
    install_distribution("acme-broken", entry_points={"mosaic.connectors": {"broken": "acme_no_module:X"}})
    done = mosaic("config", "schema")
    assert done.code == 0
    assert "left out: connector type 'broken'" in done.err
    schema = json.loads(done.out)
    connector = schema["$defs"]["ConnectorConfig"]
    assert "gauge" in connector["properties"]["type"]["anyOf"][0]["enum"]
    (then,) = (one["then"] for one in connector["allOf"] if one["if"]["properties"]["type"]["const"] == "gauge")
    assert then["required"] == ["params"]
    assert then["properties"]["params"]["required"] == ["port"]
    period = then["properties"]["params"]["properties"]["period_s"]
    assert period["anyOf"][0] == {"exclusiveMinimum": 0, "type": "number"}
    assert period["anyOf"][1]["pattern"] == r"\$\{[^{}]+\}"
    assert "gauge.params.Bus" in schema["$defs"]
    assert _dangling(schema) == []


def _dangling(schema: dict[str, Any]) -> list[str]:
    """References to definitions that aren't there."""
    found: list[str] = []

    def walk(value: Any) -> None:
        if isinstance(value, dict):
            reference = value.get("$ref")
            if isinstance(reference, str) and reference.removeprefix("#/$defs/") not in schema["$defs"]:
                found.append(reference)
            for inner in value.values():
                walk(inner)
        elif isinstance(value, list):
            for inner in value:
                walk(inner)

    walk(schema)
    return found


# -- commands of others --------------------------------------------------------------------------------------------

COMMANDS = '''
import typer
LOADED = True
app = typer.Typer()

@app.command()
def greet(name: str) -> None:
    """Greets."""
    typer.echo(f"hello {name}")

@app.command()
def fail() -> None:
    from mosaic_core import MosaicError
    raise MosaicError("no luck", code="signal.unreachable", cure="try later")

def alone(count: int = 1) -> None:
    typer.echo(f"alone {count}")
'''


SEVERAL_COMMANDS = """
from mosaic_core.cli.main import main

def run(*words):
    try:
        main(list(words))
    except SystemExit as end:
        print("code", end.code)

run("--help")
print("acme_commands" in sys.modules)
run("acme", "greet", "you")
run("alone", "--count", "3")
run("acme", "fail")
run("gone")
run("run", "--help")
"""


@pytest.fixture
def acme_commands(install_distribution: InstallDistribution) -> None:
    points = {
        "acme": "acme_commands:app",
        "alone": "acme_commands:alone",
        "gone": "acme_gone:app",
        "run": "acme_commands:app",
    }
    install_distribution("acme-tools", modules={"acme_commands": COMMANDS}, entry_points={"mosaic.commands": points})


@pytest.mark.usefixtures("acme_commands")
def test_commands_of_other_distributions_are_imported_when_invoked() -> None:
    path = [entry for entry in sys.path if "site-packages" in entry]
    done = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path[:0] = {path[:1]!r}\n{SEVERAL_COMMANDS}"],
        capture_output=True, text=True, timeout=60,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "From acme-tools" in done.stdout
    for line in ("False", "hello you", "alone 3"):
        assert line in done.stdout.splitlines()
    assert "error: no luck\n  code: signal.unreachable\n  cure: try later" in done.stderr
    assert "the command 'gone' of acme-tools 1.0.0 can't be used: ModuleNotFoundError" in done.stderr
    assert "Run a robot" in done.stdout
    assert "Traceback" not in done.stderr


def test_a_command_of_a_distribution_that_is_missing_says_what_to_install(
    mosaic: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mosaic_core.cli.main.distributions", list)
    ended = mosaic("demo", "--with", ".")
    assert ended.code == 2
    assert 'pip install "mosaic-sim[demo]"' in ended.err
