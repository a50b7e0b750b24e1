"""The commands and the folder ``connectors/``: used from a terminal, off in services, unless the option decides."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

ARM = '''
from mosaic_core import *
class Arm(DataChannelReceivable[str]):
    def handle_data(self, data: str) -> None: ...
class ArmConfigurer(DataChannelConfigurer[NoParams]):
    """An arm of our own."""
    connector_type = "arm"
    def configure(self) -> Arm:
        return Arm(self.label)
'''
ON, OFF = "--local-connectors", "--no-local-connectors"


class Terminal:
    def isatty(self) -> bool:
        return True


@pytest.fixture
def arm_yaml(robot_yaml: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A robot with an arm whose file stands beside its own, and a file that can't be read."""
    robot_yaml.write_text(robot_yaml.read_text() + "  - { type: arm, label: arm }\n")
    folder = robot_yaml.parent / "connectors"
    folder.mkdir()
    (folder / "arm.py").write_text(ARM)
    (folder / "faulty.py").write_text("def (")
    monkeypatch.chdir(robot_yaml.parent)
    return robot_yaml


@pytest.fixture
def at_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", Terminal())


@pytest.fixture
def unseen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdin", None)


@pytest.mark.usefixtures("at_a_terminal")
def test_from_a_terminal_a_file_is_valid_and_a_broken_neighbour_is_told(
    mosaic: Callable[..., Any], arm_yaml: Path, caplog: pytest.LogCaptureFixture
) -> None:
    ended = mosaic("validate", str(arm_yaml))
    assert (ended.code, ended.out) == (0, f"{arm_yaml}: valid\n")
    assert "hint: SyntaxError: invalid syntax" in ended.err
    assert f"--> {arm_yaml.parent}/connectors/faulty.py:1" in ended.err
    assert caplog.messages == [f"runs code of {arm_yaml.parent}/connectors/arm.py"]


@pytest.mark.usefixtures("unseen")
def test_without_a_terminal_nothing_is_run_unless_the_option_is_given(
    mosaic: Callable[..., Any], arm_yaml: Path
) -> None:
    refused = mosaic("validate", str(arm_yaml))
    assert refused.code == 2
    assert "is not run: no terminal started it, and no --local-connectors" in refused.err
    assert "or with --local-connectors" in refused.err
    assert mosaic("validate", str(arm_yaml), ON).code == 0


@pytest.mark.usefixtures("at_a_terminal")
def test_the_option_may_say_no_at_a_terminal(mosaic: Callable[..., Any], arm_yaml: Path) -> None:
    refused = mosaic("validate", str(arm_yaml), OFF)
    assert refused.code == 2
    assert "is not run: --no-local-connectors says so" in refused.err


def test_it_is_listed_without_being_run_and_shown(
    mosaic: Callable[..., Any], arm_yaml: Path, caplog: pytest.LogCaptureFixture
) -> None:
    listed = mosaic("connectors", "list", "--json")
    (found,) = [one for one in json.loads(listed.out) if one["type"] == "arm"]
    expected = {"type": "arm", "description": "An arm of our own.", "distribution": "connectors/arm.py", "version": ""}
    assert found == expected
    assert "faulty.py:1" in listed.err
    assert caplog.messages == []
    shown = mosaic("connectors", "show", "arm", ON)
    assert shown.out.startswith("arm  (connectors/arm.py)\nAn arm of our own.\n")


def test_what_others_could_have_written_is_left_out_of_the_list(mosaic: Callable[..., Any], arm_yaml: Path) -> None:
    (arm_yaml.parent / "connectors").chmod(0o777)
    listed = mosaic("connectors", "list")
    assert "arm.py" not in listed.out
    assert "connectors can be written by other users than its owner (chmod go-w)" in listed.err


def test_editors_complete_it(mosaic: Callable[..., Any], arm_yaml: Path) -> None:
    ended = mosaic("config", "schema", ON)
    variants = json.loads(ended.out)["$defs"]["ConnectorConfig"]["allOf"]
    assert {"const": "arm"} in [one["if"]["properties"]["type"] for one in variants]


def test_the_drill_exercises_it(mosaic: Callable[..., Any], arm_yaml: Path) -> None:
    ended = mosaic("safety", "drill", str(arm_yaml), ON, "--json", "--only", "stop")
    assert "arm" in [json.loads(line)["label"] for line in ended.out.splitlines()]


def test_the_doctor_examines_it(mosaic: Callable[..., Any], arm_yaml: Path) -> None:
    words = ["doctor", str(arm_yaml), "--json", "--only", "install", "--only", "config", "--only", "code"]
    found = json.loads(mosaic(*words, ON).out)["findings"]
    by_check = {one["check"]: one for one in found}
    assert "arm" in by_check["install.plugins"]["facts"]["types"]
    assert by_check["config.yaml"]["status"] == "ok"
    assert "faulty.py:1: SyntaxError" in by_check["install.local"]["sentence"]
    off = json.loads(mosaic(*words, OFF).out)["findings"]
    assert "Code beside the file is not run: --no-local-connectors says so." in [one["sentence"] for one in off]


def test_a_robot_runs_it_and_says_so_in_its_log(arm_yaml: Path) -> None:
    words = [sys.executable, "-m", "mosaic_core.cli.main", "run", str(arm_yaml), "--json", ON]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            snapshots = (json.loads(line) for line in process.stdout)
            rows = next(one["connectors"] for one in snapshots if one["connectors"])
            assert [row["label"] for row in rows] == ["link", "arm"]
        finally:
            process.terminate()
            _, log = process.communicate(timeout=10)
    assert log.count(f"runs code of {arm_yaml.parent}/connectors/arm.py") == 1
    assert "faulty.py:1: SyntaxError: invalid syntax" in log
