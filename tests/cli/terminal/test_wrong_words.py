"""What somebody typed wrongly is answered in a line or a block with its cause, its cure and the right exit code."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from mosaic_core.cli.terminal.error_report import report
from mosaic_core.words.errors import DeviceGone

Mosaic = Callable[..., Any]
COMMANDS = (("run",), ("validate",), ("service", "print"), ("safety", "drill"))


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
@pytest.mark.parametrize(
    ("name", "said", "cure"),
    [
        (
            "robto.yaml",
            "can't be read: No such file or directory",
            "did you mean 'robot.yaml'? Else `mosaic config init`",
        ),
        ("zzz/none", "can't be read: No such file or directory", "`mosaic config init` writes one"),
        (".", "can't be read: Is a directory", "name a file in it: ROBOT"),
        ("folder", "can't be read: Is a directory", "name a YAML file; there is none in this folder"),
        ("empty.yaml", "is empty", "`mosaic config init` writes a file to start from"),
        ("binary.yaml", "is not UTF-8 text", "name the robot's own YAML file, and save it as UTF-8"),
        ("large.yaml", "larger than 256 KiB", "name the robot's own YAML file"),
    ],
)
def test_a_file_that_is_none_is_told_with_the_one_that_may_be_meant(
    mosaic: Mosaic, robot_yaml: Path, command: tuple[str, ...], name: str, said: str, cure: str
) -> None:
    (robot_yaml.parent / "folder").mkdir()
    (robot_yaml.parent / "empty.yaml").touch()
    (robot_yaml.parent / "binary.yaml").write_bytes(b"\xff\xfe\x00")
    (robot_yaml.parent / "large.yaml").write_text(" " * 300_000)
    if name == ".":
        for other in ("empty", "binary", "large"):
            (robot_yaml.parent / f"{other}.yaml").unlink()
    ended = mosaic(*command, str(robot_yaml.parent / name))
    assert ended.code == 2
    assert f"error: {said}" in ended.err
    assert f"       = {cure.replace('ROBOT', str(robot_yaml))}" in ended.err


def test_a_file_of_somebody_else_is_told_with_what_to_do(
    mosaic: Mosaic, robot_yaml: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: Any, **__: Any) -> Any:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", refused)  # root may read everything
    ended = mosaic("validate", str(robot_yaml))
    assert ended.code == 2
    assert "can't be read: Permission denied" in ended.err
    assert "= let this account read it" in ended.err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("plugin", "new", "Bad Name", "--sensor"), "'Bad Name' is no name for a plugin"),
        (("plugin", "check", "nothing-of-this-name"), "no distribution, folder or connector type"),
    ],
)
def test_a_word_that_is_no_plugin_is_a_mistake_of_usage(mosaic: Mosaic, words: tuple[str, ...], said: str) -> None:
    ended = mosaic(*words)
    assert ended.code == 2
    assert said in ended.err
    assert "\n  cure: " in ended.err


def test_a_file_that_can_not_be_written_is_told_with_the_folder_to_make(mosaic: Mosaic, tmp_path: Path) -> None:
    ended = mosaic("config", "init", str(tmp_path / "none" / "robot.yaml"))
    assert ended.code == 2
    assert ended.err.splitlines()[1] == f"  cure: mkdir -p {tmp_path / 'none'}"


def test_a_cure_that_the_message_ends_with_is_told_once(capsys: pytest.CaptureFixture[str]) -> None:
    report(DeviceGone("no lamp on /dev/x", "plug it in"))
    assert capsys.readouterr().err == "error: no lamp on /dev/x\n  code: plugin.no_device\n  cure: plug it in\n"
