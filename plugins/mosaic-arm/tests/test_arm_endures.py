"""A whole arm on a real line, byte by byte: noise, a silent motor, an adapter that is pulled out and back."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from support.devices.servo_chain import ServoChain

from mosaic_arm.calibration import MotorCalibration, write_calibration
from mosaic_arm.params import ArmParams, JointParams
from mosaic_arm.shared_arm import KeptArm
from mosaic_core import Refused
from mosaic_core.contract.devices.keeper import RETRY

MOTORS = [1, 2, 3]
GOAL, TORQUE, PRESENT, OFFSET = 42, 40, 56, 31


class Plugged:
    """The place where adapters are plugged in, which keeps its name, and an arm that is turned by hand on it."""

    def __init__(self, folder: Path) -> None:
        self.port = folder / "bus"
        self.now_s = 0.0
        file = folder / "arm.json"
        ranges = {
            f"joint {one}": MotorCalibration(id=one, homing_offset=7, range_min=500, range_max=3500) for one in MOTORS
        }
        write_calibration(file, ranges)
        joints = {f"joint {one}": JointParams(id=one) for one in MOTORS}
        params = ArmParams(port=str(self.port), joints=joints, gripper=None, calibration=str(file))
        self.arm = KeptArm(params, clock=lambda: self.now_s)

    def plug(self, chain: ServoChain, ticks: int, offset: int = 7) -> None:
        self.port.unlink(missing_ok=True)
        self.port.symlink_to(chain.port)
        for servo in chain.motors.values():
            servo.put(PRESENT, ticks, 2)
            servo.put(OFFSET, offset, 2)

    def turn(self, times: int = 1, step_s: float = 0.01) -> None:
        for _ in range(times):
            self.now_s += step_s
            self.arm.turn()


@pytest.fixture
def plugged(tmp_path: Path) -> Plugged:
    return Plugged(tmp_path)


def written(chain: ServoChain, address: int) -> list[tuple[int, bytes]]:
    """What was written to a register of all motors, with where among the instructions."""
    return [
        (at, params[2:])
        for at, (_, code, params) in enumerate(chain.instructions)
        if code == 0x83 and params[0] == address
    ]


def test_minutes_of_noise_on_the_line_move_nothing(plugged: Plugged) -> None:
    chance = random.Random(5)
    with ServoChain(MOTORS) as chain:
        plugged.plug(chain, 2000)
        plugged.turn()
        for _ in range(300):
            chain.noise = bytes(chance.choice((0x00, 0x13, 0x42, 0x7F, 0xFF)) for _ in range(chance.randrange(6)))
            plugged.turn()
        assert plugged.arm.snapshot is not None
        assert {one.ticks for one in plugged.arm.snapshot.motors.values()} == {2000}
        assert {data for _, data in written(chain, GOAL)} == {bytes([1, 0xD0, 7, 2, 0xD0, 7, 3, 0xD0, 7])}
        assert chain.complaints == []


def test_a_position_that_can_not_be_is_not_believed_until_it_is_said_twice(plugged: Plugged) -> None:
    with ServoChain(MOTORS) as chain:
        plugged.plug(chain, 2000)
        plugged.turn(2)
        chain.follows = False
        chain.motors[2].put(PRESENT, 3100, 2)
        plugged.turn()
        plugged.arm.hold()
        chain.motors[2].put(PRESENT, 2000, 2)
        plugged.turn(5)
        assert {data[3:6] for _, data in written(chain, GOAL)} == {bytes([2, 0xD0, 7])}
        assert plugged.arm.lost_replies == 1
        chain.motors[2].put(PRESENT, 3100, 2)
        plugged.turn(2)
        assert plugged.arm.snapshot is not None
        assert plugged.arm.snapshot.motors["joint 2"].ticks == 3100


def test_pulled_out_for_thirty_seconds_it_comes_back_and_holds_where_it_sank_to(plugged: Plugged) -> None:
    with ServoChain(MOTORS) as chain:
        plugged.plug(chain, 2000)
        plugged.turn(2)
        plugged.arm.aim({"joint 1": 1.0}, "somebody")
        plugged.turn(10)
        chain.vanish()
        plugged.turn(6, 5.0)
    assert plugged.arm.snapshot is None
    with pytest.raises(Refused, match="can't be opened"):
        plugged.arm.aim({"joint 1": 1.0}, "somebody")
    with ServoChain(MOTORS) as chain:
        plugged.plug(chain, 1700)
        plugged.turn(1, RETRY.max_s)
        plugged.turn(100)
        goals, torques = written(chain, GOAL), written(chain, TORQUE)
        assert goals[0][0] < torques[0][0]
        assert {data for _, data in goals} == {bytes([1, 0xA4, 6, 2, 0xA4, 6, 3, 0xA4, 6])}
        assert chain.complaints == []


def test_another_arm_in_the_same_plug_is_not_powered(plugged: Plugged) -> None:
    with ServoChain(MOTORS) as chain:
        plugged.plug(chain, 2000)
        plugged.turn(2)
        chain.vanish()
        plugged.turn()
    with ServoChain(MOTORS) as chain:
        plugged.plug(chain, 2000, offset=9)
        plugged.turn(3, RETRY.max_s)
        assert written(chain, GOAL) == written(chain, TORQUE) == []
    assert "motor 1 (joint 1) keeps the offset 9, and" in plugged.arm.gone.message
    assert "says 7" in plugged.arm.gone.message


@pytest.mark.usefixtures("soon_silent")
def test_a_motor_that_falls_silent_ends_the_commands_and_is_named_until_it_answers(plugged: Plugged) -> None:
    with ServoChain(MOTORS) as chain:
        plugged.plug(chain, 2000)
        plugged.turn(2)
        chain.drops[2] = 1_000_000
        plugged.turn(3, 0.11)
        assert "motor 2 (joint 2) does not answer any more" in plugged.arm.gone.message
        with pytest.raises(Refused, match="does not answer"):
            plugged.arm.aim({"joint 1": 1.0}, "somebody")
        chain.drops[2] = 0
        plugged.turn(1, RETRY.max_s)
        assert plugged.arm.snapshot is not None
