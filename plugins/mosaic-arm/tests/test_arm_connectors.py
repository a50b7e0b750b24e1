"""The connectors of an arm, as operators and their absence move it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from mosaic_arm.calibration import MotorCalibration, write_calibration
from mosaic_arm.freedrive import ArmFreedriveConfigurer
from mosaic_arm.gripper import ArmGripperConfigurer
from mosaic_arm.health import ArmHealthConfigurer
from mosaic_arm.joints import TIMEOUT_S, ArmJointsConfigurer
from mosaic_arm.params import SO101
from mosaic_arm.pose_names import ArmPoseNamesConfigurer
from mosaic_arm.poses import THERE_RAD, ArmPosesConfigurer
from mosaic_arm.state import ArmStateConfigurer
from mosaic_core import AutoConfigurer, Delivery, DeviceGone
from mosaic_core.contract.devices.keeper import RETRY
from mosaic_core.runtime.configuration.config_loader import validate_file
from mosaic_core.testing import Cleared, Leaves, LosesLease, Silence, Stopped, ask, collect, feed
from mosaic_core.words.errors import MosaicError

if TYPE_CHECKING:
    from conftest import ArmOnClock

TYPES = {"arm-joints", "arm-state", "arm-gripper", "arm-poses", "arm-pose-names", "arm-freedrive", "arm-health"}
FAST = {"slow_down": "off", "timeout_s": 0.3}
BEND = {"names": ["elbow_flex"], "positions": [1.0]}


def driven(seconds: float) -> list[Any]:
    """Commands twenty times a second."""
    return [step for _ in range(round(seconds * 20)) for step in (BEND, Silence(0.05))]


@pytest.fixture
def joints(on_clock: ArmOnClock) -> Any:
    return on_clock.build(ArmJointsConfigurer, FAST)


# -- joints ----------------------------------------------------------------------------------------------------------


def test_a_joint_goes_where_it_is_told(on_clock: ArmOnClock, joints: Any) -> None:
    feed(joints, driven(1.5))
    assert on_clock.angle("elbow_flex") == pytest.approx(1.0, abs=0.01)
    assert on_clock.angle("shoulder_pan") == pytest.approx(0.0, abs=0.01)


@pytest.mark.parametrize("end", [Silence(0.31), Leaves(), LosesLease(), Stopped()])
def test_the_arm_stands_still_when_its_operator_is_no_more(on_clock: ArmOnClock, joints: Any, end: Any) -> None:
    fed = feed(joints, [*driven(0.4), end, Silence(0.1)])
    assert len(fed.made_safe) >= 1
    stands = on_clock.angle("elbow_flex")
    on_clock.clock.advance(2.0)
    assert on_clock.angle("elbow_flex") == pytest.approx(stands, abs=0.03)
    assert stands < 0.9


def test_after_a_stop_the_first_command_begins_where_the_arm_is(on_clock: ArmOnClock, joints: Any) -> None:
    feed(joints, [*driven(0.4), Stopped(), Silence(1.0), Cleared(), Silence(1.0)])
    stands = on_clock.angle("elbow_flex")
    feed(joints, [BEND, Silence(0.1)])
    assert abs(on_clock.angle("elbow_flex") - stands) <= 1.5 * 0.1 + 0.01  # at its rate


def test_one_target_moves_it_no_longer_than_its_time_out(on_clock: ArmOnClock) -> None:
    feed(on_clock.build(ArmJointsConfigurer), [BEND, Silence(3.0)])
    assert 0 < on_clock.angle("elbow_flex") < 1.5 * TIMEOUT_S + 0.1


def test_a_joint_that_it_does_not_have_and_what_is_no_number_are_refused(joints: Any) -> None:
    fed = feed(
        joints, [{"names": ["tail"], "positions": [0.0]}, '{"names": ["elbow_flex"], "positions": [NaN]}', b"\x00"]
    )
    assert fed.accepted == []
    assert len(fed.refused) == 3


def test_a_flood_moves_it_no_faster(on_clock: ArmOnClock, joints: Any) -> None:
    feed(joints, [step for _ in range(500) for step in (BEND, Silence(0.001))])
    assert on_clock.angle("elbow_flex") <= 0.5 * 1.5 + 0.01


def test_commands_are_refused_while_the_bus_is_away(on_clock: ArmOnClock, joints: Any) -> None:
    on_clock.bus.is_gone = True
    on_clock.clock.advance(1.0)
    fed = feed(joints, [BEND])
    assert [one.code for one in fed.refused] == ["plugin.no_device"]


def test_a_bus_that_goes_between_two_commands_refuses_the_second(on_clock: ArmOnClock, joints: Any) -> None:
    feed(joints, [BEND, Silence(0.05), BEND])
    on_clock.bus.is_gone = True
    fed = feed(joints, [Silence(0.05), BEND])
    assert fed.accepted == []
    assert len(fed.refused) == 1


def test_a_target_may_say_in_how_much_time(on_clock: ArmOnClock) -> None:
    joints = on_clock.build(ArmJointsConfigurer, {"timeout_s": 3.0})
    feed(joints, [{**BEND, "duration_s": 2.0}, Silence(1.0)])
    assert on_clock.angle("elbow_flex") == pytest.approx(0.5, abs=0.06)
    on_clock.clock.advance(1.5)
    assert on_clock.angle("elbow_flex") == pytest.approx(1.0, abs=0.01)


# -- state and health ------------------------------------------------------------------------------------------------


def test_the_state_has_every_joint_at_the_rate_asked_for(on_clock: ArmOnClock) -> None:
    began_s = on_clock.clock.now_s
    states = collect(on_clock.build(ArmStateConfigurer, rate_hz=10), 11)
    assert on_clock.clock.now_s - began_s == pytest.approx(1.0)
    assert states[0].names == list(on_clock.arm.joints)
    assert (len(states[0].positions), len(states[0].velocities), states[0].efforts) == (6, 6, [])


def test_the_state_of_a_bus_that_is_away_for_thirty_seconds_is_gone_and_then_told_again(on_clock: ArmOnClock) -> None:
    state = on_clock.build(ArmStateConfigurer)
    assert len(collect(state, 2)) == 2
    on_clock.bus.is_gone = True
    for _ in range(6):  # as the robot tries again
        on_clock.clock.advance(5.0)
        with pytest.raises(DeviceGone, match="the port is lost"):
            collect(state, 1)
    on_clock.bus.is_gone = False
    on_clock.clock.advance(RETRY.max_s)
    assert len(collect(state, 2)) == 2


def health(on_clock: ArmOnClock) -> Any:
    return collect(on_clock.build(ArmHealthConfigurer), 1)[0]


def test_health_names_what_is_hot_and_what_a_motor_protects_itself_from(on_clock: ArmOnClock) -> None:
    assert (health(on_clock).level, health(on_clock).message) == ("ok", "all motors are well")
    on_clock.bus.temperatures[2] = 61.0
    on_clock.clock.advance(0.1)
    assert (health(on_clock).level, "shoulder_lift: hot" in health(on_clock).message) == ("warn", True)
    on_clock.bus.faults[3] = ("overload",)
    on_clock.clock.advance(0.1)
    assert (health(on_clock).level, "elbow_flex: overload" in health(on_clock).message) == ("error", True)


def test_health_goes_on_while_the_bus_is_away(on_clock: ArmOnClock) -> None:
    on_clock.bus.is_gone = True
    on_clock.clock.advance(30.0)
    assert (health(on_clock).level, health(on_clock).message) == ("stale", "the port is lost")
    on_clock.bus.is_gone = False
    on_clock.clock.advance(RETRY.max_s)
    assert health(on_clock).level == "ok"


# -- the gripper -----------------------------------------------------------------------------------------------------


def test_the_gripper_opens_in_metres_and_presses_no_harder_than_it_may(on_clock: ArmOnClock) -> None:
    gripper = on_clock.build(ArmGripperConfigurer, FAST)
    step = {"position": 0.07, "max_effort": 5.0}
    feed(gripper, [one for _ in range(80) for one in (step, Silence(0.05))])
    assert gripper.reported_position("position") == pytest.approx(0.07, abs=0.002)
    assert ("limit", {6: 12.5}) in on_clock.bus.told  # a quarter of its force, of half its torque


def test_what_the_gripper_holds_stays_held_when_its_operator_is_no_more(on_clock: ArmOnClock) -> None:
    """It is sent further than it can close: the difference is what it presses with."""
    gripper = on_clock.build(ArmGripperConfigurer, FAST)
    feed(gripper, [one for _ in range(40) for one in ({"position": 0.03}, Silence(0.05))])
    motor = on_clock.arm.joints["gripper"].motor
    before = on_clock.bus.in_the_way[motor] = on_clock.bus.read()[motor].ticks
    feed(gripper, [one for _ in range(40) for one in ({"position": 0.0}, Silence(0.05))])
    pressed = on_clock.bus.told[-1][1][motor]
    on_clock.clock.advance(2.0)
    assert on_clock.bus.told[-1][1][motor] == pytest.approx(pressed, abs=1)
    assert abs(pressed - before) > 100


def test_an_arm_without_a_gripper_has_no_such_connector(on_clock: ArmOnClock) -> None:
    with pytest.raises(MosaicError, match="this arm has no gripper"):
        on_clock.build(ArmGripperConfigurer, arm={"bus": "fake", "port": "none", "gripper": None})


# -- poses -----------------------------------------------------------------------------------------------------------

REST = {"rest": {"shoulder_lift": -0.6, "elbow_flex": 0.9}}


def test_the_arm_goes_to_a_pose_with_all_joints_arriving_together(on_clock: ArmOnClock) -> None:
    poses = on_clock.build(ArmPosesConfigurer, poses=REST)
    answered = ask(poses, {"action": "go", "name": "rest", "speed_percent": 50})
    assert answered.refused is None
    assert on_clock.angle("elbow_flex") == pytest.approx(0.9, abs=THERE_RAD)
    assert on_clock.angle("shoulder_lift") == pytest.approx(-0.6, abs=THERE_RAD)
    shares = [one["done_percent"] for one in answered.progress]
    assert shares == sorted(shares)
    assert shares[-1] == 100.0


def test_a_request_that_is_taken_back_ends_the_way_there(on_clock: ArmOnClock) -> None:
    poses = on_clock.build(ArmPosesConfigurer, poses=REST)
    ask(poses, {"action": "go", "name": "rest"}, cancel_after_s=0.5)
    stands = on_clock.angle("elbow_flex")
    on_clock.clock.advance(3.0)
    assert 0.05 < stands < 0.5
    assert on_clock.angle("elbow_flex") == pytest.approx(stands, abs=0.03)


class HoldsAt:
    """Somebody else's command or a stop, at its time."""

    def __init__(self, on_clock: ArmOnClock, after_s: float) -> None:
        self.due_at_s: float | None = on_clock.clock.now_s + after_s
        self._arm = on_clock.arm

    def ring(self, now_s: float) -> None:
        self.due_at_s = None
        self._arm.hold()


def test_a_stop_on_the_way_is_the_end_of_the_way(on_clock: ArmOnClock) -> None:
    poses = on_clock.build(ArmPosesConfigurer, poses=REST)
    on_clock.clock.watch(HoldsAt(on_clock, 0.5))
    answered = ask(poses, {"action": "go", "name": "rest"})
    assert answered.refused is not None
    assert answered.refused.code == "arm.overtaken"
    assert on_clock.angle("elbow_flex") < 0.5


def test_the_present_pose_is_saved_and_is_there_after_a_restart(on_clock: ArmOnClock, tmp_path: Path) -> None:
    file = tmp_path / "poses.json"
    poses = on_clock.build(ArmPosesConfigurer, poses=REST, file=str(file))
    assert ask(poses, {"action": "save", "name": "here"}).answer == {"names": ["here", "rest"], "off_by_rad": None}
    assert set(json.loads(file.read_text())["here"]) == set(on_clock.arm.joints)
    again = on_clock.build(ArmPosesConfigurer, poses=REST, file=str(file))
    assert ask(again, {"action": "go", "name": "here"}).refused is None


def test_whoever_looks_is_told_which_poses_there_are(on_clock: ArmOnClock, tmp_path: Path) -> None:
    names = on_clock.build(ArmPoseNamesConfigurer)
    poses = on_clock.build(ArmPosesConfigurer, poses=REST, file=str(tmp_path / "poses.json"))
    assert names.delivery is Delivery.RELIABLE  # whoever comes later gets the last one
    assert [one.names for one in collect(names, 1)] == [["rest"]]
    ask(poses, {"action": "save", "name": "here"})
    assert [one.names for one in collect(names, 1)] == [["here", "rest"]]


def test_poses_that_were_described_anew_are_told_without_those_before(on_clock: ArmOnClock) -> None:
    names = on_clock.build(ArmPoseNamesConfigurer)
    for poses in (REST, {"folded": REST["rest"]}):
        on_clock.build(ArmPosesConfigurer, poses=poses)
    assert [one.names for one in collect(names, 1)] == [["folded"]]


@pytest.mark.parametrize(
    ("question", "code"),
    [
        ({"action": "go", "name": "nowhere"}, "arm.unknown_pose"),
        ({"action": "go"}, "channel.invalid"),
        ({}, "channel.invalid"),
        ({"action": "save", "name": "here"}, "arm.no_pose_file"),
        ({"action": "go", "name": "rest", "speed_percent": 0.1}, "arm.too_slow"),
        ({"action": "dance"}, "channel.invalid"),
        ({"action": "go", "name": "../etc"}, "channel.invalid"),
    ],
)
def test_what_can_not_be_done_is_refused_with_its_reason(on_clock: ArmOnClock, question: Any, code: str) -> None:
    refused = ask(on_clock.build(ArmPosesConfigurer, poses=REST), question).refused
    assert refused is not None
    assert refused.code == code


def test_a_pose_that_there_is_not_is_told_with_the_nearest(on_clock: ArmOnClock) -> None:
    refused = ask(on_clock.build(ArmPosesConfigurer, poses=REST), {"action": "go", "name": "rets"}).refused
    assert refused is not None
    assert refused.message == "no pose is called 'rets'; did you mean 'rest'? There are: rest"


ARM = {"bus": "fake", "port": "trial"}
WRONG = {"elbow_flx": {"id": 3, "range_min": 700, "range_max": 3000}}


@pytest.mark.parametrize(
    ("kind", "params", "path", "message", "cure"),
    [
        ("arm-joints", {"arm": {**ARM, "gripper": "griper"}}, "arm", "did you mean 'gripper'? There are sho", ""),
        (
            "arm-poses",
            {"arm": ARM, "poses": {"rest": {"gripper": 0.0}, "wave": {"elbow_flx": 1.0}}},
            "poses.wave.elbow_flx",
            "the pose 'wave' names the joint 'elbow_flx', which this arm does not have",
            "did you mean 'elbow_flex'?",
        ),
        (
            "arm-poses",
            {"arm": ARM, "file": "FILE"},
            "file",
            "FILE: the pose 'elbow_flx' names the joint 'id', which this arm does not have",
            "it has: shoulder_pan, shoulder_lift, elbow_flex, wrist_flex, wrist_roll, gripper",
        ),
        (
            "arm-joints",
            {"arm": {**ARM, "calibration": "FILE", "joints": {"elbow_flex": {"id": 3}}, "gripper": None}},
            "",
            "calibration FILE: the joint 'elbow_flex' is missing; it has elbow_flx.",
            "Write 'elbow_flx' alike in both, or calibrate again: mosaic arm calibrate FILE",
        ),
    ],
)
def test_an_unknown_joint_is_told_with_the_nearest_and_the_file_that_names_it(
    tmp_path: Path, kind: str, params: dict[str, Any], path: str, message: str, cure: str
) -> None:
    file = tmp_path / "joints.json"
    file.write_text(json.dumps(WRONG))
    robot = tmp_path / "robot.yaml"
    robot.write_text(json.dumps({"connectors": [{"type": kind, "label": "arm", "params": params}]}).replace(
        '"FILE"', json.dumps(str(file))))  # fmt: skip
    validation = validate_file(robot)
    told = [*validation.problems, *AutoConfigurer().rehearse(validation).problems][0]
    assert told.path == ".".join(filter(None, ("connectors[0].params", path)))
    assert message.replace("FILE", str(file)) in told.message
    assert told.cure == cure.replace("FILE", str(file))


def test_a_pose_file_that_is_none_is_told_before_anything_starts(on_clock: ArmOnClock, tmp_path: Path) -> None:
    file = tmp_path / "poses.json"
    file.write_text('{"rest": {"tail": 1.0}}')
    with pytest.raises(MosaicError, match="names the joint 'tail'"):
        on_clock.build(ArmPosesConfigurer, file=str(file))
    file.write_text("[")
    with pytest.raises(MosaicError, match="pose file"):
        on_clock.build(ArmPosesConfigurer, file=str(file))


# -- freedrive -------------------------------------------------------------------------------------------------------


def test_the_motors_go_off_only_if_somebody_holds_the_arm(on_clock: ArmOnClock) -> None:
    freedrive = on_clock.build(ArmFreedriveConfigurer)
    refused = ask(freedrive, {"motors_off": True}).refused
    assert refused is not None
    assert (refused.code, "0.6 kg" in refused.message) == ("arm.not_held", True)
    answer = ask(freedrive, {"motors_off": True, "somebody_holds_the_arm": True}).answer
    assert "falls unless somebody holds its 0.6 kg" in answer["message"]
    on_clock.clock.advance(0.1)
    assert on_clock.bus.told[-1] == ("torque", False)
    ask(freedrive, {"motors_off": False})
    on_clock.clock.advance(0.1)
    assert [one for one in on_clock.bus.told if one[0] == "torque"][-1] == ("torque", True)


@pytest.mark.parametrize(
    "configurer", [ArmJointsConfigurer, ArmGripperConfigurer, ArmPosesConfigurer, ArmFreedriveConfigurer]
)
def test_whatever_moves_the_arm_needs_its_lease(on_clock: ArmOnClock, configurer: Any) -> None:
    handler = on_clock.build(configurer)
    assert (handler.requires_lease, handler.resource) == (True, "arm")


@pytest.mark.parametrize("name", ["follower", "leader"])
def test_the_examples_are_valid_with_a_calibration_beside_them(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    joints = {
        joint: MotorCalibration(id=number, range_min=700, range_max=3400) for number, joint in enumerate(SO101, 1)
    }
    write_calibration(tmp_path / f"{name}.json", joints)
    monkeypatch.chdir(tmp_path)
    file = Path(__file__).parents[3] / "examples" / "so101-arm" / f"{name}.yaml"
    configured = AutoConfigurer().from_file(file, environ={"MOSAIC_TOKEN": "secret"})
    assert {one.config.type for one in configured.connectors} <= TYPES
    assert len(configured.connectors) == (7 if name == "follower" else 1)
