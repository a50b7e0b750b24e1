"""Calibration: the file, what is found by hand, and what is asked of the person."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
import typer
from hypothesis import given
from hypothesis import strategies as st
from support.devices.servo_chain import DynamixelChain, ServoChain

from mosaic_arm.calibration import MotorCalibration, read_calibration, write_calibration
from mosaic_arm.commands.calibrate_session import EnterKey, calibrate, write_to_motors
from mosaic_arm.commands.calibrating import MIDDLE, RangeRecorder, middle_offset
from mosaic_arm.params import ArmParams, JointParams
from mosaic_core.words.errors import MosaicError

if TYPE_CHECKING:
    from mosaic_arm.params import BusType

ONE = {"elbow": {"id": 3, "drive_mode": 1, "homing_offset": -12, "range_min": 800, "range_max": 3200}}


def test_a_file_as_lerobot_writes_it_is_read_and_written(tmp_path: Path) -> None:
    file = tmp_path / "arm.json"
    file.write_text(json.dumps(ONE, indent=4))
    found = read_calibration(file, {"elbow": 3})
    assert found["elbow"] == MotorCalibration(id=3, drive_mode=1, homing_offset=-12, range_min=800, range_max=3200)
    write_calibration(file, found)
    assert json.loads(file.read_text()) == ONE
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"range_max": 700}, "are no range within one turn"),
        ({"range_max": 9000}, "range_max"),
        ({"id": 4}, "'elbow' is motor 4 there and 3 in the params"),
        ({"drive_mode": 2}, "elbow.drive_mode"),
        ({"id": "3"}, "elbow.id"),
        ({"speed": 1}, "elbow.speed"),
        (None, "the joint 'elbow' is missing"),
    ],
)
def test_a_file_that_can_not_be_meant_is_told_with_its_place_and_a_cure(
    tmp_path: Path, change: dict[str, object] | None, said: str
) -> None:
    file = tmp_path / "arm.json"
    file.write_text(json.dumps({} if change is None else {"elbow": {**ONE["elbow"], **change}}))
    with pytest.raises(MosaicError, match=said) as error:
        read_calibration(file, {"elbow": 3})
    assert "mosaic arm calibrate" in str(error.value)


@pytest.mark.parametrize("text", ["", "[]", "{", "x" * 70_000])
def test_a_file_that_is_none_is_told(tmp_path: Path, text: str) -> None:
    file = tmp_path / "arm.json"
    file.write_text(text)
    with pytest.raises(MosaicError, match=r"arm\.json"):
        read_calibration(file, {"elbow": 3})


def test_a_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(MosaicError, match="it can't be read: No such file"):
        read_calibration(tmp_path / "none.json", {"elbow": 3})


@given(st.integers(-8192, 8192), st.booleans())
def test_with_its_offset_a_motor_tells_the_middle(ticks: int, is_added: bool) -> None:
    offset = middle_offset(ticks, is_added=is_added)
    told = ticks + offset if is_added else ticks - offset
    assert (told - MIDDLE) % 4096 in (0, 1)


def test_joints_that_were_not_moved_are_named() -> None:
    recorder = RangeRecorder(["roll"])
    recorder.saw({"a": 1000, "b": 2000, "roll": 5})
    recorder.saw({"a": 3000, "b": 2010, "roll": 6})
    with pytest.raises(MosaicError, match="hardly moved: b"):
        recorder.calibrations({"a": 1, "b": 2, "roll": 3}, {"a": 0, "b": 0, "roll": 0})
    recorder.saw({"b": 2500})
    found = recorder.calibrations({"a": 1, "b": 2, "roll": 3}, {"a": 7, "b": 0, "roll": 0})
    assert (found["a"].homing_offset, found["a"].range_min, found["a"].range_max) == (7, 1000, 3000)
    assert (found["roll"].range_min, found["roll"].range_max) == (0, 4095)


# -- guided, on motors that check every byte ---------------------------------------------------------------------------


class Hands:
    """A person: moves the motors, then presses Enter, at each step."""

    def __init__(self, *moves: list[Callable[[], None]]) -> None:
        self._moves = iter(moves)

    def __call__(self) -> Hands:
        self._steps: Iterator[Callable[[], None]] = iter(next(self._moves))
        return self

    def was_pressed(self, within_s: float) -> bool:
        step = next(self._steps, None)
        if step is not None:
            step()
        return step is None


@pytest.fixture(params=["feetech", "dynamixel"])
def chain(request: pytest.FixtureRequest) -> Iterator[ServoChain]:
    with (ServoChain if request.param == "feetech" else DynamixelChain)([1, 2]) as chain:
        chain.follows = False
        yield chain
        assert chain.complaints == []


def params_of(chain: ServoChain) -> ArmParams:
    kind: BusType = "dynamixel" if isinstance(chain, DynamixelChain) else "feetech"
    joints = {"elbow": JointParams(id=1), "roll": JointParams(id=2)}
    return ArmParams(bus=kind, port=chain.port, joints=joints, gripper=None)


def test_a_calibration_by_hand_ends_in_the_motors_and_in_the_file(chain: ServoChain, tmp_path: Path) -> None:
    def put(motor: int, ticks: int) -> Callable[[], None]:
        return lambda: chain.motors[motor].put(chain.present[0], ticks, chain.present[1])

    hands = Hands([], [put(1, 2500), put(2, 100)], [put(1, 900), put(1, 3100)])
    file = tmp_path / "arm.json"
    params = params_of(chain)
    found = calibrate(params, file, ["roll"], enter=hands)  # type: ignore[arg-type]
    sign = -1 if params.bus == "dynamixel" else 1
    assert found["elbow"].homing_offset == sign * (2500 - MIDDLE)
    assert (found["elbow"].range_min, found["elbow"].range_max) == (900, 3100)
    assert (found["roll"].range_min, found["roll"].range_max) == (0, 4095)
    assert read_calibration(file, {"elbow": 1, "roll": 2}) == found
    torque = 64 if params.bus == "dynamixel" else 40
    assert [chain.motors[motor].registers[torque] for motor in (1, 2)] == [0, 0]


def test_a_file_is_written_into_motors_and_nothing_else_moves(chain: ServoChain, tmp_path: Path) -> None:
    file = tmp_path / "arm.json"
    joints = {
        name: MotorCalibration(id=n, homing_offset=5, range_min=1, range_max=4000)
        for n, name in ((1, "elbow"), (2, "roll"))
    }
    write_calibration(file, joints)
    write_to_motors(params_of(chain), file)
    assert all(code != 0x83 or params[0] != chain.goal[0] for _, code, params in chain.instructions)


@pytest.mark.usefixtures("soon_silent")
def test_a_motor_that_is_missing_is_named_before_anything_is_let_go(chain: ServoChain, tmp_path: Path) -> None:
    del chain.motors[2]
    params = params_of(chain)
    with pytest.raises(MosaicError, match=r"do not answer: 2 \(roll\)"):
        calibrate(params, tmp_path / "arm.json", [], enter=Hands())  # type: ignore[arg-type]
    assert all(code == 0x01 for _, code, _ in chain.instructions)


def test_the_end_of_the_input_is_nobody_who_holds_the_arm() -> None:
    with pytest.raises(typer.Abort):
        EnterKey(lambda: "").was_pressed(5.0)
    assert EnterKey(lambda: "\n").was_pressed(5.0)
