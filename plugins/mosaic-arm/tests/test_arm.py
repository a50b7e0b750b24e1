"""The arm: it never swings, keeps each joint at its rate, and comes back when its bus does."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from mosaic_arm.calibration import MotorCalibration, write_calibration
from mosaic_arm.params import ArmParams, ExitPolicy, JointParams
from mosaic_arm.shared_arm import KeptArm, shared_arm
from mosaic_core import MosaicError, Refused, Shared
from mosaic_core.contract.devices.keeper import RETRY
from mosaic_core.testing import FakeClock

if TYPE_CHECKING:
    from conftest import ArmOnClock

ME = object()


def test_the_power_comes_after_goals_that_are_where_the_arm_is(on_clock: ArmOnClock) -> None:
    assert [what for what, _ in on_clock.bus.told[:3]] == ["limit", "goals", "torque"]
    assert on_clock.bus.told[1][1] == dict.fromkeys(range(1, 7), 2048)


def test_a_joint_moves_at_its_rate_and_arrives(on_clock: ArmOnClock) -> None:
    on_clock.arm.aim({"elbow_flex": 1.2}, ME)
    on_clock.clock.advance(0.4)
    assert 0.4 < on_clock.angle("elbow_flex") <= 0.6  # 1.5 rad/s, and a motor that lags a little
    on_clock.clock.advance(1.0)
    assert on_clock.angle("elbow_flex") == pytest.approx(1.2, abs=0.01)


def test_held_it_stands_where_it_is_and_nothing_of_before_counts(on_clock: ArmOnClock) -> None:
    on_clock.arm.aim({"elbow_flex": 1.2}, ME)
    on_clock.clock.advance(0.4)
    assert on_clock.arm.is_led_by(ME, ["elbow_flex"])
    on_clock.arm.hold()
    stands = on_clock.angle("elbow_flex")
    on_clock.clock.advance(2.0)
    assert on_clock.angle("elbow_flex") == pytest.approx(stands, abs=0.06)
    assert not on_clock.arm.is_led_by(ME, ["elbow_flex"])


def test_a_bus_that_vanishes_for_thirty_seconds_comes_back_and_the_arm_stands(on_clock: ArmOnClock) -> None:
    on_clock.arm.aim({"elbow_flex": 1.2}, ME)
    on_clock.clock.advance(0.2)
    on_clock.bus.is_gone = True
    on_clock.clock.advance(30.0)
    assert on_clock.arm.snapshot is None
    with pytest.raises(Refused, match="the port is lost"):
        on_clock.arm.aim({"elbow_flex": 1.2}, ME)
    was, on_clock.bus.is_gone = on_clock.bus.told.copy(), False
    on_clock.clock.advance(RETRY.max_s)
    assert on_clock.arm.snapshot is not None
    new = on_clock.bus.told[len(was) :]
    assert [what for what, _ in new[:3]] == ["limit", "goals", "torque"]
    stands = on_clock.angle("elbow_flex")
    on_clock.clock.advance(2.0)
    assert on_clock.angle("elbow_flex") == pytest.approx(stands, abs=0.01)


def test_a_bus_that_is_gone_is_tried_ever_more_slowly(on_clock: ArmOnClock) -> None:
    on_clock.bus.is_gone = True
    on_clock.clock.advance(60.0)
    assert on_clock.bus.opened == 1
    before_s = on_clock.clock.now_s
    assert on_clock.due_at_s is not None
    assert on_clock.due_at_s - before_s <= RETRY.max_s


def test_a_reply_that_is_lost_now_and_then_is_counted_and_no_more(on_clock: ArmOnClock) -> None:
    on_clock.bus.silent = {3}
    on_clock.clock.advance(0.1)
    on_clock.bus.silent = set()
    on_clock.clock.advance(1.0)
    assert on_clock.arm.snapshot is not None
    assert 5 <= on_clock.arm.lost_replies <= 12


def test_a_motor_that_stays_silent_is_gone_and_named(on_clock: ArmOnClock) -> None:
    on_clock.bus.silent = {3}
    on_clock.clock.advance(0.5)
    assert on_clock.arm.snapshot is None
    assert "motor 3 (elbow_flex)" in on_clock.arm.gone.message


def test_a_motor_that_is_missing_at_the_beginning_is_named(on_clock: ArmOnClock) -> None:
    on_clock.bus.is_gone = True
    on_clock.clock.advance(1.0)
    on_clock.bus.is_gone, on_clock.bus.not_there = False, [2]
    on_clock.clock.advance(6.0)
    assert "do not answer: 2 (shoulder_lift)" in on_clock.arm.gone.message


def test_free_the_arm_can_be_moved_by_hand_and_stays_there_when_the_power_comes(on_clock: ArmOnClock) -> None:
    on_clock.arm.power(on=False)
    on_clock.clock.advance(1.0)
    sunk = on_clock.angle("shoulder_lift")
    assert sunk < -0.1
    with pytest.raises(Refused) as refused:
        on_clock.arm.aim({"shoulder_lift": 0.0}, ME)
    assert refused.value.code == "arm.free"
    on_clock.arm.power(on=True)
    on_clock.clock.advance(1.0)
    assert on_clock.angle("shoulder_lift") == pytest.approx(sunk, abs=0.02)


def test_a_bus_that_comes_back_leaves_a_free_arm_free(on_clock: ArmOnClock) -> None:
    on_clock.arm.power(on=False)
    on_clock.bus.is_gone = True
    on_clock.clock.advance(5.0)
    on_clock.bus.is_gone, told = False, len(on_clock.bus.told)
    on_clock.clock.advance(5.0)
    assert on_clock.arm.snapshot is not None
    assert ("torque", True) not in on_clock.bus.told[told:]


@pytest.mark.parametrize(("policy", "lets_go"), [("hold", False), ("release", True)])
def test_at_the_end_the_arm_holds_or_is_let_go_by_choice(
    fake_clock: FakeClock, on_clock: ArmOnClock, policy: ExitPolicy, lets_go: bool
) -> None:
    one = type(on_clock)(fake_clock, ArmParams(bus="fake", port="end", on_exit=policy))
    one.arm.close()
    assert (("torque", False) in one.bus.told) is lets_go
    assert one.arm.snapshot is None


def test_limits_of_the_params_narrow_the_calibrated_range(fake_clock: FakeClock, on_clock: ArmOnClock) -> None:
    joints = {"elbow": JointParams(id=1, min_rad=-0.5, max_rad=0.25)}
    one = type(on_clock)(fake_clock, ArmParams(bus="fake", port="narrow", joints=joints, gripper=None))
    one.arm.aim({"elbow": 9.0}, ME)
    one.clock.advance(2.0)
    assert one.angle("elbow") == pytest.approx(0.25, abs=0.01)


def calibrated(folder: Path) -> ArmParams:
    file = folder / "arm.json"
    write_calibration(file, {"elbow": MotorCalibration(id=1, homing_offset=7, range_min=1000, range_max=3000)})
    joints = {"elbow": JointParams(id=1)}
    return ArmParams(bus="fake", port="calibrated", joints=joints, gripper=None, calibration=str(file))


def test_an_arm_with_another_ones_calibration_does_not_move(
    fake_clock: FakeClock, on_clock: ArmOnClock, tmp_path: Path
) -> None:
    one = type(on_clock)(fake_clock, calibrated(tmp_path))
    assert "motor 1 (elbow) keeps the offset None" in one.arm.gone.message
    assert "--write" in one.arm.gone.message
    one.bus.offsets = {1: 7}
    one.clock.advance(1.0)
    assert one.arm.snapshot is not None
    assert ("torque", True) in one.bus.told


def test_limits_that_leave_nothing_of_the_range_are_told(tmp_path: Path) -> None:
    params = calibrated(tmp_path)
    joints = {"elbow": JointParams(id=1, min_rad=2.0, max_rad=3.0)}
    with pytest.raises(MosaicError, match="leave nothing of the calibrated range"):
        KeptArm(params.model_copy(update={"joints": joints}))


def test_connectors_that_describe_one_port_differently_are_told() -> None:
    shared = Shared()
    shared_arm(ArmParams(port="/dev/ttyACM0"), shared)
    with pytest.raises(MosaicError, match="describe the arm at /dev/ttyACM0 differently: rate_hz"):
        shared_arm(ArmParams(port="/dev/ttyACM0", rate_hz=50), shared)


def test_the_thread_opens_the_arm_and_ends() -> None:
    arm = KeptArm(ArmParams(bus="fake", port="thread"))
    with arm:
        assert arm.wait_open(5.0)
        assert arm.snapshot is not None
    assert arm.snapshot is None
    with arm:
        assert arm.wait_open(5.0)
