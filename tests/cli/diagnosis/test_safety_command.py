"""`mosaic safety drill`: what it prints, how it ends, and what it refuses to do."""

from __future__ import annotations

import json
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from mosaic_core.cli.diagnosis.safety_commands import _show
from mosaic_core.drill import findings
from mosaic_core.drill.findings import DrillFinding

BASE = """\
  - { type: cmd-vel, label: cmd_vel, params: { drive: { type: log } } }
"""


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """How late a busy machine is must not decide here."""
    monkeypatch.setattr(findings, "TOLERANCE_S", 10.0)


@pytest.fixture
def base_yaml(robot_yaml: Path) -> Path:
    robot_yaml.write_text(robot_yaml.read_text() + BASE)
    return robot_yaml


def test_the_drill_prints_a_table_and_ends_well(mosaic: Callable[..., Any], base_yaml: Path) -> None:
    ended = mosaic("safety", "drill", str(base_yaml), "--only", "silence", "--only", "stranger")
    assert ended.code == 0, ended.err
    assert "300 ms" in ended.out
    assert "2 passed, 0 failed" in ended.out
    assert "no device was touched" in ended.out


def test_the_drill_needs_no_server_and_no_secret_of_the_robot(mosaic: Callable[..., Any], tmp_path: Path) -> None:
    file, auth = (
        tmp_path / "robot.yaml",
        "{ type: simple-token, robot_id: '${MY_ID}', params: { token: '${MY_TOKEN}' } }",
    )
    file.write_text(f"server: {{ ws_url: 'wss://mosaic.example.org', auth: {auth} }}\nconnectors:\n{BASE}")
    ended = mosaic("safety", "drill", str(file), "--only", "safe-action")
    assert ended.code == 0, ended.err
    file.write_text(f"connectors:\n{BASE}    safety: {{ timeout_s: '${{MY_TIMEOUT}}' }}\n")
    ended = mosaic("safety", "drill", str(file))
    assert ended.code == 2
    assert "MY_TIMEOUT" in ended.err


def test_in_a_pipe_a_row_is_a_line(
    mosaic: Callable[..., Any], base_yaml: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    ended = mosaic("safety", "drill", str(base_yaml), "--only", "frozen-picture", "--only", "too-fast")
    lines = [line.rstrip() for line in ended.out.splitlines()]
    assert any(line.endswith("the configuration has no camera") for line in lines)
    assert any(line.startswith("too-fast ") and "max_rate_hz" in line for line in lines)


def test_on_a_narrow_terminal_the_reasons_stand_below(capsys: pytest.CaptureFixture[str]) -> None:
    why = "the safe action did not run, or did not return"
    found = [
        DrillFinding("stop", "base", "failed", "50 ms", "none", why),
        DrillFinding("silence", "base", "passed", "300 ms"),
    ]
    _show(found, Console(width=80, color_system=None), live=True)
    lines = [line.rstrip() for line in capsys.readouterr().out.splitlines()]
    assert [line.split()[0] for line in lines[:3]] == ["what", "stop", "silence"]
    assert lines[3:] == [f"stop, base: {why}", "1 passed, 1 failed, 0 skipped"]


@pytest.mark.parametrize("width", [80, 100, 120, 160])
def test_a_long_limit_gives_way_and_what_was_exercised_of_whom_stays_readable(
    width: int, capsys: pytest.CaptureFixture[str]
) -> None:
    limit = "positions.a_joint_whose_name_is_long_enough_for_a_whole_line_of_its_own = -3.14083 and 5 more"
    found = [
        DrillFinding("holds-position", "left_arm_joints", "passed", limit, "it stayed", "because " * 12),
        DrillFinding("old-epoch", "left_arm_joints", "passed", "lease.old_epoch", "lease.old_epoch", gate="epoch"),
    ]
    _show(found, Console(width=width, color_system=None), live=True)
    lines = capsys.readouterr().out.splitlines()
    for exercise in ("holds-position", "old-epoch"):
        row = next(line for line in lines if line.startswith(f"{exercise} "))
        assert row.split()[1] == "left_arm_joints"
        assert "passed" in row


def test_the_drill_speaks_json(mosaic: Callable[..., Any], base_yaml: Path) -> None:
    ended = mosaic("safety", "drill", str(base_yaml), "--only", "leaves", "--json")
    lines = [json.loads(line) for line in ended.out.splitlines()]
    found = next(line for line in lines if line["label"] == "cmd_vel")
    assert (found["exercise"], found["verdict"]) == ("leaves", "passed")
    assert found["measured_s"] >= 0


def test_a_failure_is_exit_code_1(mosaic: Callable[..., Any], base_yaml: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from mosaic_core.drill import silence

    monkeypatch.setattr(silence, "has_safe_action", lambda kind: False)
    ended = mosaic("safety", "drill", str(base_yaml), "--only", "safe-action")
    assert ended.code == 1
    assert "make_safe is not written" in " ".join(ended.out.split())


def test_a_misspelt_exercise_names_the_nearest(mosaic: Callable[..., Any], base_yaml: Path) -> None:
    ended = mosaic("safety", "drill", str(base_yaml), "--only", "silense")
    assert ended.code == 2
    assert "did you mean 'silence'?" in ended.err


def test_devices_are_not_driven_where_nobody_can_be_asked(mosaic: Callable[..., Any], base_yaml: Path) -> None:
    ended = mosaic("safety", "drill", str(base_yaml), "--live")
    assert ended.code == 2
    assert "--yes" in ended.err
    assert ended.out == ""


def test_a_wrong_file_is_told_before_anything_runs(mosaic: Callable[..., Any], tmp_path: Path) -> None:
    ended = mosaic("safety", "drill", str(tmp_path / "nothing.yaml"))
    assert ended.code == 2
    assert "nothing.yaml" in ended.err


SLED = """\
import os
import signal
from pathlib import Path

from mosaic_core import DataChannelConfigurer, DataChannelJsonReceivable, NoParams


class Sled(DataChannelJsonReceivable):
    timeout_s = 5.0
    motion_fields = ("speed_mps",)
    has_interrupted = False

    def handle_data(self, data):
        if not self.has_interrupted:  # a second one would end this very process
            self.has_interrupted = True
            os.kill(os.getpid(), signal.{signal})

    def make_safe(self, cause):
        with Path(__file__).with_suffix(".told").open("a") as told:
            told.write(cause + "\\n")
        {safe}


class SledConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "sled"

    def configure(self):
        return Sled(self.label)
"""


@pytest.mark.parametrize(
    ("number", "safe", "told"),
    [
        (signal.SIGINT, "pass", "interrupted: the safe actions have run"),
        (signal.SIGTERM, "pass", "interrupted: the safe actions have run"),
        (signal.SIGINT, "raise OSError('the bus is gone')", "interrupted: a SAFE ACTION DID NOT END"),
    ],
)
def test_a_drill_that_is_interrupted_makes_safe_first_and_ends(
    mosaic: Callable[..., Any], tmp_path: Path, number: signal.Signals, safe: str, told: str
) -> None:
    (tmp_path / "connectors").mkdir()
    own = tmp_path / "connectors" / "sled.py"
    own.write_text(SLED.format(signal=number.name, safe=safe))
    file = tmp_path / "robot.yaml"
    file.write_text("connectors:\n  - { type: sled, label: sled }\n")
    before = signal.getsignal(number)
    ended = mosaic("safety", "drill", str(file), "--live", "--yes", "--local-connectors")
    assert ended.code == 128 + number
    assert told in ended.err
    assert own.with_suffix(".told").read_text().count("safety.shutdown") >= 1
    assert "1 passed, 0 failed" in ended.out, "what was found until then is told"
    assert signal.getsignal(number) == before
