"""`mosaic connectors show` tells what its author did wrong as `mosaic validate` does, and shows the rest."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

HEAD = """\
from pydantic import Field
from mosaic_core import *
class Deg(Message):
    deg: float
class Gauge(DataChannelSendable[Deg]):
    def messages(self):
        yield Deg(deg=1.0)
"""
FIRST = HEAD.count("\n") + 1
CONFIGURER = """\
class Shown(DataChannelConfigurer[NoParams]):
    connector_type = "shown"
    def configure(self):
"""


@pytest.fixture
def shown(tmp_path: Path, mosaic: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    def show(code: str, *words: str) -> Any:
        (tmp_path / "connectors").mkdir()
        (tmp_path / "connectors" / "shown.py").write_text(HEAD + code)
        monkeypatch.chdir(tmp_path)
        return mosaic("connectors", "show", "shown", "--local-connectors", *words)

    return show


def handler(body: str) -> str:
    """The type with a gauge whose ``__init__`` says more."""
    own = f"class Own(Gauge):\n    def __init__(self, label):\n        {body}\n"
    return f"{own}{CONFIGURER}        return Own(self.label)\n"


@pytest.mark.parametrize(
    ("code", "line", "told"),
    [
        (f"{CONFIGURER}        pass\n", 2, "can't be made: configure() returned None instead of a handler"),
        (f"{CONFIGURER}        return Gauge\n", 2, "can't be made: configure() returned the class Gauge instead of"),
        (f"{CONFIGURER}        raise SystemExit('bye')\n", 3, "can't be made: SystemExit: bye"),
        (f"{CONFIGURER}        return [Gauge('a'), Gauge('a')]\n", 2, "makes two handlers of one label 'a': Gauge"),
        (handler("pass"), 0, "can't be made: its handler has no label"),
        (handler("super().__init__(label); self.widget = 'nope'"), 0, "can't be made: Own: there is no widget 'nope'"),
        (
            handler("super().__init__(label); self.kind = 'servo'"),
            0,
            "can't be made: Own: it sets kind, which is read of its class.",
        ),
        (
            handler("super().__init__(label); self.data_type = 'json'"),
            0,
            "can't be made: Own: it sets data_type, which is read of its class.",
        ),
    ],
    ids=["none", "class", "exit", "twins", "no super", "widget", "kind", "data type"],
)
def test_a_mistake_of_the_author_is_told_with_its_line_after_all_that_is_known(
    shown: Callable[..., Any], tmp_path: Path, code: str, line: int, told: str
) -> None:
    ended = shown(code)
    assert ended.code == 2
    assert f"error: connector 'shown' of connectors/shown.py {told}" in ended.err
    assert f"--> {tmp_path}/connectors/shown.py:{FIRST + line}  [config.broken_plugin]" in ended.err
    assert "it can't, as is told below" in ended.out
    assert "  - type: shown" in ended.out


NEEDS = """\
class Needs(Params):
    top: float = Field(description="Most degrees.")
class Arm(DataChannelReceivable[Deg]):
    position_fields = ("deg",)
    def __init__(self, label, top):
        super().__init__(label)
        self.limits = {"deg": FieldBounds(min=5, max=top)}
    def handle_data(self, data): ...
class Shown(DataChannelConfigurer[Needs]):
    connector_type = "shown"
    def configure(self):
        return Arm(self.label, self.params.top)
"""


@pytest.mark.parametrize("words", [(), ("--json",)], ids=["people", "programs"])
def test_limits_that_a_placeholder_makes_impossible_are_nobodys_mistake(
    shown: Callable[..., Any], tmp_path: Path, words: tuple[str, ...]
) -> None:
    ended = shown(NEEDS, *words)
    cause = json.loads(ended.out)["unmade"] if words else ended.out
    assert ended.code == 0
    line = FIRST + 2
    assert f"{tmp_path}/connectors/shown.py:{line}: connector 'shown': limit of deg: min 5 is above max 1" in cause


REFUSED = """\
class Few(Params):
    joints: int = Field(default=2, le=6)
class Shown(DataChannelConfigurer[Few]):
    connector_type = "shown"
    example = {"joints": 7}
    def configure(self):
        return Gauge(self.label)
"""


@pytest.mark.parametrize("words", [(), ("--json",)], ids=["people", "programs"])
def test_an_example_that_its_own_params_refuse_is_told_with_its_line(
    shown: Callable[..., Any], tmp_path: Path, words: tuple[str, ...]
) -> None:
    ended = shown(REFUSED, *words)
    assert ended.code == 2
    assert (
        "error: the example of Shown is refused by its own params: params.joints: expected a number ≤ 6, got 7"
        in ended.err
    )
    assert f"--> {tmp_path}/connectors/shown.py:{FIRST + 4}  [config.broken_plugin]" in ended.err


def test_validate_hints_at_an_example_that_is_refused(
    shown: Callable[..., Any], mosaic: Callable[..., Any], tmp_path: Path
) -> None:
    shown(REFUSED)
    (tmp_path / "robot.yaml").write_text("connectors: [{type: shown, label: x}]\n")
    ended = mosaic("validate", str(tmp_path / "robot.yaml"), "--local-connectors")
    assert (ended.code, ended.out) == (0, f"{tmp_path}/robot.yaml: valid\n")
    assert "the example of Shown is refused by its own params: params.joints: expected a number ≤ 6, got 7" in ended.err
    assert f"--> {tmp_path}/connectors/shown.py:{FIRST + 4}" in ended.err
