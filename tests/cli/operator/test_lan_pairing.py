"""`mosaic operator pair` and signing in by it: no PIN as an argument, and an account that is named comes first."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any
from uuid import UUID

import pytest

from mosaic_core.operator.lan.paired_robots import PairedRobot, PairedRobots
from mosaic_core.operator.lan.pairing import PairablePlace

ROVER = str(UUID(int=7))


@pytest.fixture
def operator(mosaic: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Any:
    """`mosaic operator …` where no account is named and one robot is paired, which is away."""
    for name in ("MOSAIC_EMAIL", "MOSAIC_PASSWORD", "MOSAIC_SERVER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("MOSAIC_DATA_DIR", str(tmp_path))
    robot = PairedRobot(robot_id=ROVER, name="Rover", url="http://127.0.0.1:9", access_token="a.b.c")  # noqa: S106
    PairedRobots().keep(robot)

    async def nobody(for_s: float) -> list[object]:
        return []

    monkeypatch.setattr("mosaic_core.operator.lan.pairing.announced_robots", nobody)
    return lambda *words: mosaic("operator", *words)


def test_a_pin_is_no_argument(operator: Any) -> None:
    ended = operator("pair", "10.0.0.7", "12345678")
    assert ended.code == 2
    ended = operator("pair", "10.0.0.7", "--pin", "12345678")
    assert ended.code == 2


def test_without_a_terminal_the_pin_comes_by_stdin(operator: Any) -> None:
    ended = operator("pair", "10.0.0.7")
    assert (ended.code, "--pin-stdin" in ended.err) == (2, True)


def test_a_robot_that_is_not_there_is_told_before_a_pin_is_asked(operator: Any) -> None:
    assert "code: signal.unreachable" in operator("pair", "http://127.0.0.1:9", "--pin-stdin").err
    assert "code: lan.not_found" in operator("pair", "Rovr", "--pin-stdin").err


@pytest.mark.parametrize("given", ["", "\n", "  \n12345678\n", " - \n", "http://10.0.0.7/#pair=\n"], ids=repr)
def test_a_line_without_a_pin_is_told_before_any_is_tried(
    operator: Any, monkeypatch: pytest.MonkeyPatch, given: str
) -> None:
    async def found(robot: str) -> PairablePlace:
        return PairablePlace("Rover", "http://127.0.0.1:9")

    monkeypatch.setattr("mosaic_core.cli.operator.lan_pairing.place_to_pair", found)
    monkeypatch.setattr("sys.stdin", io.StringIO(given))
    ended = operator("pair", "Rover", "--pin-stdin")
    assert (ended.code, ended.err.splitlines()[1:]) == (
        2,
        [
            "error: no PIN: the first line of stdin is empty",
            "  cure: give it the PIN or code on the robot's screen",
        ],
    )


@pytest.mark.parametrize("name", ["Rover", ROVER, "127.0.0.1:9"])
def test_a_paired_robot_is_reached_where_no_account_is_named(operator: Any, name: str) -> None:
    assert "code: lan.not_found" in operator("lease", name).err


def test_an_account_that_is_named_comes_first_and_lan_before_it(operator: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MOSAIC_EMAIL", "me@example.org")
    assert "MOSAIC_PASSWORD" in operator("lease", "Rover").err
    assert "code: lan.not_found" in operator("lease", "Rover", "--lan").err


def test_who_is_neither_paired_nor_has_an_account_hears_of_both(operator: Any) -> None:
    ended = operator("lease", "Arm")
    assert ended.code == 2
    assert "--email" in ended.err
    assert "mosaic operator pair" in ended.err
    assert "code: lan.not_paired" in operator("lease", "Arm", "--lan").err


def test_unpairing_a_robot_that_is_away_says_that_it_still_knows_this_machine(operator: Any) -> None:
    ended = operator("unpair", "Rover")
    assert (ended.code, "mosaic lan devices revoke" in ended.err) == (0, True)
    assert PairedRobots().all() == []
