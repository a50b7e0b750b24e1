"""`mosaic operator robots --lan`: who announces itself, who asks for a PIN, who is paired and away."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, cast
from uuid import UUID

import pytest

from mosaic_core.cli.operator import lan_robots
from mosaic_core.cli.operator.operator_session import connected
from mosaic_core.machines.lan.announced_robots import AnnouncedRobot
from mosaic_core.operator import MosaicOperator, RobotSummary
from mosaic_core.operator.lan.paired_robots import PairedRobot, PairedRobots
from mosaic_core.words.errors import SignalingError

TOKEN = "a.b.c"  # noqa: S105 - of nobody
ROVER, ARM, AWAY = (str(UUID(int=number)) for number in (7, 8, 9))


@pytest.fixture
def announced(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[AnnouncedRobot]:
    """Whom the search finds; nobody is paired and nobody has said who they are."""
    monkeypatch.setenv("MOSAIC_DATA_DIR", str(tmp_path))
    for name in ("MOSAIC_EMAIL", "MOSAIC_PASSWORD", "MOSAIC_SERVER"):
        monkeypatch.delenv(name, raising=False)
    found: list[AnnouncedRobot] = []

    async def search(for_s: float) -> list[AnnouncedRobot]:
        return found

    monkeypatch.setattr(lan_robots, "announced_robots", search)
    return found


def keep(robot_id: str, name: str) -> None:
    PairedRobots().keep(PairedRobot(robot_id=robot_id, name=name, url="http://10.0.0.9:9002", access_token=TOKEN))


def test_robots_are_listed_with_whether_they_ask_for_a_pin(mosaic: Any, announced: list[AnnouncedRobot]) -> None:
    announced += [
        AnnouncedRobot("Arm", ARM, ("http://10.0.0.8:9002",), "0.1.0"),
        AnnouncedRobot("Rover", ROVER, ("http://10.0.0.7:9002", "http://rover.local:9002"), "0.1.0"),
    ]
    keep(ROVER, "Rover")
    keep(AWAY, "Boat")
    lines = [json.loads(line) for line in mosaic("operator", "robots", "--lan", "--json").out.splitlines()]
    told = {line["name"]: (line["asksForPin"], line["announced"], line["urls"][0]) for line in lines}
    assert told == {
        "Arm": (True, True, "http://10.0.0.8:9002"),
        "Rover": (False, True, "http://10.0.0.7:9002"),
        "Boat": (False, False, "http://10.0.0.9:9002"),
    }
    heading, *rows = mosaic("operator", "robots", "--lan").out.splitlines()
    assert heading.split() == ["name", "id", "address", "state"]
    assert [row.split()[0] for row in rows] == ["Arm", "Rover", "Boat"]
    states = ["asks for a PIN", "paired", "paired, not announced now"]
    assert [row.rstrip().rpartition("  ")[2] for row in rows] == states


def test_nobody_is_told_with_what_to_look_for(mosaic: Any, announced: list[AnnouncedRobot]) -> None:
    ended = mosaic("operator", "robots", "--lan")
    assert (ended.code, announced) == (0, [])
    assert "mosaic run --serve" in ended.out


@pytest.mark.usefixtures("announced")
def test_who_has_no_account_is_told_where_paired_robots_are_listed(mosaic: Any) -> None:
    keep(ROVER, "Rover")
    ended = mosaic("operator", "robots")
    assert ended.code == 2
    assert "mosaic operator robots --lan" in ended.err


@pytest.mark.usefixtures("announced")
@pytest.mark.parametrize(
    ("words", "works"),
    [
        (("call", "Acmee", "survey", '{"looks": 3}'), """mosaic operator call Acme survey '{"looks": 3}' --lan"""),
        (("stop", "acme", "--reason", "a dog"), "mosaic operator stop Acme --reason 'a dog' --lan"),
        (("lease", "Acmee", "--take"), "mosaic operator lease Acme --take --lan"),
    ],
)
def test_a_misspelt_paired_robot_is_named_with_the_command_that_works(
    mosaic: Any, words: tuple[str, ...], works: str
) -> None:
    keep(ROVER, "Acme")
    ended = mosaic("operator", *words)
    assert ended.code == 2
    assert "did you mean 'Acme'?" in ended.err
    assert f"cure: write {works}\n" in ended.err


@pytest.mark.usefixtures("announced")
def test_a_robot_like_no_paired_one_is_told_with_those_that_are_and_how_to_pair_or_sign_in(mosaic: Any) -> None:
    keep(ROVER, "Rover")
    ended = mosaic("operator", "call", "Zeppelin", "survey")
    assert ended.code == 2
    assert "not paired with a robot 'Zeppelin'; it is with 'Rover'" in ended.err
    for cure in ("mosaic operator pair", "--email"):
        assert cure in ended.err.partition("cure: ")[2]


@pytest.mark.usefixtures("announced")
def test_the_cure_of_a_misspelt_name_with_lan_is_the_name(mosaic: Any) -> None:
    keep(ROVER, "Acme")
    ended = mosaic("operator", "call", "Acmee", "survey", "--lan")
    assert ended.code == 1
    assert "did you mean 'Acme'?" in ended.err
    assert "cure: Use that name" in ended.err


class SignedIn:
    """Somebody whose account has one robot."""

    paired_id = None

    async def robots(self) -> list[RobotSummary]:
        return [RobotSummary(id=ARM, name="Arm")]


@pytest.mark.usefixtures("announced")
@pytest.mark.parametrize(
    ("wanted", "message", "more"),
    [
        ("Armm", "no robot 'Armm'; did you mean 'Arm'?", ""),
        ("Rovr", "no robot 'Rovr'.", "; with --lan this machine reaches 'Rover', which it is paired with"),
    ],
)
async def test_who_is_signed_in_is_told_of_the_robot_that_is_meant(wanted: str, message: str, more: str) -> None:
    keep(ROVER, "Rover")
    with pytest.raises(SignalingError) as caught:
        await connected(cast("MosaicOperator", SignedIn()), wanted)
    assert caught.value.message == message
    assert caught.value.cure == f"robots of this account: Arm ({ARM}){more}"
