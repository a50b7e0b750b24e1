"""Who holds what: the silence of one connector holds what it moves, and anything worse holds the whole arm."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_arm.gripper import ArmGripperConfigurer
from mosaic_arm.joints import ArmJointsConfigurer
from mosaic_arm.params import SO101, ArmParams
from mosaic_arm.poses import ArmPosesConfigurer
from mosaic_arm.servos.simulated_bus import SimulatedBus
from mosaic_arm.shared_arm import KeptArm
from mosaic_core.testing import Leaves, LosesLease, Silence, Stopped, ask, feed

if TYPE_CHECKING:
    from conftest import ArmOnClock

FAST = {"slow_down": "off", "timeout_s": 0.3}
BEND = {"names": ["elbow_flex"], "positions": [1.2]}
OPEN = {"position": 0.07}
ELBOW, GRIPPER = 3, 6


def goals(on_clock: ArmOnClock) -> dict[int, int]:
    """What the motors were told last."""
    return dict(next(told for what, told in reversed(on_clock.bus.told) if what == "goals"))


def is_moving(on_clock: ArmOnClock, motor: int) -> bool:
    before = goals(on_clock)[motor]
    on_clock.clock.advance(0.05)
    return abs(goals(on_clock)[motor] - before) > 2


@pytest.fixture
def joints(on_clock: ArmOnClock) -> Any:
    return on_clock.build(ArmJointsConfigurer, {"slow_down": "off", "timeout_s": 2.0})


@pytest.fixture
def gripper(on_clock: ArmOnClock) -> Any:
    return on_clock.build(ArmGripperConfigurer, FAST)


def test_a_silent_gripper_does_not_freeze_the_joints(on_clock: ArmOnClock, joints: Any, gripper: Any) -> None:
    feed(joints, [BEND])
    fed = feed(gripper, [OPEN, Silence(0.35)])
    assert [made.cause for made in fed.made_safe] == ["safety.timeout"]
    assert is_moving(on_clock, ELBOW)
    assert not is_moving(on_clock, GRIPPER)


def test_silent_joints_stand_while_the_gripper_is_told_on(on_clock: ArmOnClock, gripper: Any) -> None:
    feed(on_clock.build(ArmJointsConfigurer, {"slow_down": "off", "timeout_s": 0.1}), [BEND, Silence(0.15)])
    stands = goals(on_clock)[ELBOW]
    feed(gripper, [step for _ in range(8) for step in (OPEN, Silence(0.05))])
    assert is_moving(on_clock, GRIPPER)
    assert goals(on_clock)[ELBOW] == pytest.approx(stands, abs=2)


def test_joints_that_fell_silent_do_not_end_the_way_to_a_pose(on_clock: ArmOnClock) -> None:
    feed(on_clock.build(ArmJointsConfigurer, {"slow_down": "off", "timeout_s": 0.1}), [BEND])
    on_clock.clock.watch(SafeAt(on_clock, 0.2))
    poses = on_clock.build(ArmPosesConfigurer, poses={"up": {"elbow_flex": 0.8}})
    assert ask(poses, {"name": "up", "speed_percent": 50}).refused is None
    assert on_clock.angle("elbow_flex") == pytest.approx(0.8, abs=0.1)


class SafeAt:
    """The time-out of somebody who commanded before."""

    def __init__(self, on_clock: ArmOnClock, after_s: float) -> None:
        self.due_at_s: float | None = on_clock.clock.now_s + after_s
        self._arm = on_clock.arm

    def ring(self, now_s: float) -> None:
        self.due_at_s = None
        self._arm.make_safe("safety.timeout", object())


@pytest.mark.parametrize("end", [Leaves(), LosesLease(), Stopped()])
def test_an_end_that_the_gripper_hears_of_holds_the_joints_too(
    on_clock: ArmOnClock, joints: Any, gripper: Any, end: Any
) -> None:
    feed(joints, [BEND])
    feed(gripper, [OPEN, Silence(0.1), end, Silence(0.05)])
    assert not is_moving(on_clock, ELBOW)
    assert not is_moving(on_clock, GRIPPER)


CAUSES = ("safety.timeout", "safety.stop", "safety.lease_lost", "safety.peer_left", "safety.shutdown", "safety.reload")
Tell = tuple[str, str, float]
tells = st.tuples(st.sampled_from("AB"), st.sampled_from(SO101), st.floats(-1.5, 1.5))


class Turned:
    """An arm whose turns are taken one after another, a hundredth of a second apart."""

    def __init__(self) -> None:
        self.now_s = 0.0
        params = ArmParams(bus="fake", port="property")
        clock = lambda: self.now_s  # noqa: E731
        bus = SimulatedBus(list(params.calibrations().values()), clock)
        self.arm = KeptArm(params, bus, clock)
        self.turn()

    def turn(self, times: int = 1) -> dict[str, float]:
        for _ in range(times):
            self.now_s += 0.01
            self.arm.turn()
        assert self.arm.snapshot is not None
        return dict(self.arm.snapshot.angles_rad)


@given(st.lists(tells, min_size=1, max_size=12), st.sampled_from(CAUSES), st.sampled_from("AB"))
def test_whatever_was_told_what_shall_stand_stands_and_what_may_go_on_arrives(
    told: list[Tell], cause: str, ends: str
) -> None:
    turned, owners = Turned(), dict[str, tuple[str, float]]()
    for by, joint, angle in told:
        turned.arm.aim({joint: angle}, by)
        owners[joint] = (by, angle)
        turned.turn(5)
    before = turned.turn()
    turned.arm.make_safe(cause, ends)
    after = turned.turn(400)
    for joint, (by, angle) in owners.items():
        if cause == "safety.timeout" and by != ends:
            assert after[joint] == pytest.approx(turned.arm.joints[joint].within(angle), abs=0.01)
        else:
            assert after[joint] == pytest.approx(before[joint], abs=0.1)  # a motor lags its goal by so much
