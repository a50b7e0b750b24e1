"""`mosaic demo --arm` and `--vehicle`: other robots for the same demo, if the distribution that has them is there."""

from __future__ import annotations

import io
import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from rich.console import Console

from mosaic_sim.demo import headless_check
from mosaic_sim.demo.check_program import main
from mosaic_sim.demo.demo_robot import ARM, VEHICLE, YARD, DemoRobot, chosen_robot
from mosaic_sim.demo.errors import DemoFailed
from mosaic_sim.demo.greeting import greet
from mosaic_sim.demo.headless_check import ANY_ROBOT, checked
from mosaic_sim.demo.robot_file import OwnConnector, robot_file
from mosaic_sim.demo.server import Seed

SEED = Seed("demo@localhost", "a-password", "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11", "a-token")


def test_without_a_word_it_is_the_robot_in_the_yard_and_both_at_once_are_none() -> None:
    assert chosen_robot(arm=False, vehicle=False) is YARD
    assert chosen_robot(arm=True, vehicle=False) is ARM
    assert chosen_robot(arm=False, vehicle=True) is VEHICLE
    with pytest.raises(DemoFailed) as told:
        chosen_robot(arm=True, vehicle=True)
    assert told.value.cure == "choose one of them"


def test_what_is_not_installed_is_told_with_the_cure(tmp_path: Path) -> None:
    missing = replace(ARM, package="mosaic_not_there.robots")
    with pytest.raises(DemoFailed, match="arm needs mosaic-mujoco, which is not installed") as told:
        robot_file(tmp_path, (), missing)
    assert told.value.cure == "pip install mosaic-mujoco"


@pytest.mark.parametrize(("robot", "label"), [(YARD, "battery"), (ARM, "gripper"), (VEHICLE, "cmd_vel")])
def test_its_file_stands_in_the_demos_folder_and_its_labels_are_known(
    tmp_path: Path, robot: DemoRobot, label: str
) -> None:
    made = robot_file(tmp_path, (), robot)
    assert made.path.read_text() == robot.text()
    found = {one.label: one.source for one in made.simulated}
    assert found[label] == robot.distribution


def test_the_greeting_says_what_to_try_with_it() -> None:
    out = io.StringIO()
    demo: Any = SimpleNamespace(seed=SEED, own=(), notes=(), shown=ARM)
    greet(Console(file=out, width=200), demo, "http://x/robots/1", is_opened=True)
    assert "set the sliders of `arm`" in out.getvalue()
    assert "W, A, S, D" not in out.getvalue()


def test_the_check_looks_at_each_of_its_connectors_but_that_of_the_link(monkeypatch: pytest.MonkeyPatch) -> None:
    run: list[list[str]] = []

    def ran(command: list[str], **_: Any) -> subprocess.CompletedProcess[str]:
        run.append(command)
        return subprocess.CompletedProcess(command, 0, stdout="[]", stderr="")

    monkeypatch.setattr(subprocess, "run", ran)
    simulated = (OwnConnector("arm", "mujoco-joint-target", "m"), OwnConnector("link", "connection-check", "m"))
    own = (OwnConnector("lamp", "acme-lamp", "acme"),)
    demo: Any = SimpleNamespace(
        shown=ARM, simulated=simulated, own=own, url="http://x", seed=SEED, check_alive=lambda: None,
        robot=SimpleNamespace(last_lines=lambda *_: ""),
    )  # fmt: skip
    assert checked(demo) == []
    demo.shown = YARD
    checked(demo)
    assert [command[-3:] for command in run] == [[ANY_ROBOT, "arm", "lamp"], [SEED.email, SEED.robot_id, "lamp"]]


def test_the_check_of_a_server_that_is_not_there_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv(headless_check.PASSWORD_VARIABLE, "x")
    monkeypatch.setattr(sys, "argv", ["check", "http://127.0.0.1:9", SEED.email, SEED.robot_id, ANY_ROBOT, "arm"])
    main()
    (result,) = json.loads(capsys.readouterr().out)
    assert (result["name"], result["ok"]) == ("connect", False)
