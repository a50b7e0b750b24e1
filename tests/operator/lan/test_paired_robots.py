"""What this machine keeps of robots that it is paired with: for its owner alone, by id, and told when it is damaged."""

from __future__ import annotations

import stat
from pathlib import Path
from uuid import UUID

import pytest

from mosaic_core.operator.lan.paired_robots import PairedRobot, PairedRobots
from mosaic_core.words.errors import MosaicError, SignalingError

TOKEN = "eyJhbGciOi.eyJ1c2Vy.c2lnbmF0dXJl"  # noqa: S105 - of nobody


def paired(number: int = 7, name: str = "Rover", url: str = "http://10.0.0.7:9002") -> PairedRobot:
    return PairedRobot(robot_id=str(UUID(int=number)), name=name, url=url, access_token=TOKEN)


@pytest.fixture
def robots(tmp_path: Path) -> PairedRobots:
    return PairedRobots(tmp_path / "paired")


def test_a_robot_is_kept_for_nobody_else_and_forgotten(robots: PairedRobots) -> None:
    robots.keep(paired())
    assert robots.all() == [paired()]
    [file] = robots.directory.iterdir()
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert stat.S_IMODE(robots.directory.stat().st_mode) == 0o700
    robots.forget(paired().robot_id)
    robots.forget(paired().robot_id)
    assert robots.all() == []


def test_one_robot_never_gets_the_place_of_another(robots: PairedRobots) -> None:
    for number in (7, 8):
        robots.keep(paired(number))
    assert [one.robot_id for one in robots.all()] == [str(UUID(int=7)), str(UUID(int=8))]
    with pytest.raises(SignalingError) as caught:
        robots.named("Rover")
    assert caught.value.code == "lan.several"
    assert robots.named(str(UUID(int=8))).robot_id == str(UUID(int=8))


@pytest.mark.parametrize("wanted", [str(UUID(int=7)), "Rover", "http://10.0.0.7:9002", "10.0.0.7:9002"])
def test_it_goes_by_id_name_and_address(robots: PairedRobots, wanted: str) -> None:
    robots.keep(paired())
    robots.keep(paired(9, "Arm", "http://10.0.0.9:9002"))
    assert robots.named(wanted) == paired()


def test_an_unknown_name_is_told_with_the_nearest(robots: PairedRobots) -> None:
    robots.keep(paired())
    with pytest.raises(SignalingError, match="did you mean 'Rover'") as caught:
        robots.named("Rovr")
    assert caught.value.code == "lan.not_paired"


def test_the_directory_is_where_the_data_belongs(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("MOSAIC_DATA_DIR", str(tmp_path))
    assert PairedRobots().directory == tmp_path / "paired"
    assert PairedRobots().all() == []


def test_the_sign_in_is_never_printed() -> None:
    assert TOKEN not in f"{paired()!r} {paired()}"


@pytest.mark.parametrize("text", ["", "{}", "[1]", '{"robotId": "../../x"}', f'"{TOKEN}"', "\xff", "x" * 70_000])
def test_a_damaged_file_is_told_by_name_and_without_its_content(robots: PairedRobots, text: str) -> None:
    robots.keep(paired())
    file = robots.directory / f"{UUID(int=7)}.json"
    file.write_bytes(text.encode("latin-1"))
    with pytest.raises(MosaicError, match=file.name) as caught:
        robots.all()
    assert caught.value.code == "lan.unreadable"
    assert TOKEN not in caught.value.message


def test_a_directory_that_can_not_be_made_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(MosaicError) as caught:
        PairedRobots(tmp_path / "file" / "paired").keep(paired())
    assert caught.value.code == "lan.unreadable"
