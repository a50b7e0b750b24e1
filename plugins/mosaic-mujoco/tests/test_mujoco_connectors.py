"""What a simulated robot says and does, through the kit, in a simulation that the test advances."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Any

import pytest

from mosaic_core import ConfigError, Shared
from mosaic_core.messages import GripperTarget, Imu, JointTarget, Odometry, Pose, Range
from mosaic_core.runtime.configuration.catalogue_entry import catalogue_entries
from mosaic_core.testing import Silence, Stopped, ask, build, collect, fake_host, feed
from mosaic_mujoco.connectors.control import MujocoControlConfigurer
from mosaic_mujoco.connectors.gripper_target import MujocoGripperTargetConfigurer
from mosaic_mujoco.connectors.health import MujocoHealthConfigurer, diagnosed
from mosaic_mujoco.connectors.joint_target import MujocoJointTargetConfigurer
from mosaic_mujoco.connectors.joints import MujocoJointsConfigurer
from mosaic_mujoco.connectors.odometry import MujocoOdometryConfigurer
from mosaic_mujoco.connectors.reset import MujocoResetConfigurer
from mosaic_mujoco.connectors.sensor import MujocoSensorConfigurer, SensorReading
from mosaic_mujoco.world.live_simulation import PaceReport, shared_simulation

if TYPE_CHECKING:
    from conftest import ModelWriter
    from mosaic_mujoco.world.simulation import Simulation

GRIPPER = {"model": "arm", "actuator": "gripper", "opening_m": 0.08}


def sensed(shared: Shared, model: str, sensor: str, **more: Any) -> Any:
    """The next message of a sensor."""
    params = {"model": model, "sensor": sensor, **more}
    return collect(build(MujocoSensorConfigurer, params=params, shared=shared), 1)[0]


def angles(shared: Shared) -> dict[str, float]:
    state = collect(build(MujocoJointsConfigurer, params={"model": "arm"}, shared=shared), 1)[0]
    return dict(zip(state.names, state.positions, strict=True))


# -- joints and grippers -----------------------------------------------------------------------------------------


def test_joints_are_told_by_name_with_speed_and_force(shared: Shared, arm: Simulation) -> None:
    arm.aim({2: 0.0}, {2: 1.0})
    arm.advance(200)
    params = {"model": "arm", "joints": ["shoulder", "elbow"]}
    state = collect(build(MujocoJointsConfigurer, params=params, shared=shared), 1)[0]
    assert state.names == ["shoulder", "elbow"]
    assert state.velocities[1] == pytest.approx(-1.0, abs=0.1)
    assert state.efforts[1] < -0.5


def test_a_target_moves_the_joints_that_it_names_and_no_other(shared: Shared, arm: Simulation) -> None:
    target = build(MujocoJointTargetConfigurer, params={"model": "arm"}, shared=shared)
    before = angles(shared)
    feed(target, [JointTarget(names=["elbow", "base_yaw"], positions=[1.2, 0.3])])
    arm.advance(500)
    after = angles(shared)
    assert after["elbow"] == pytest.approx(1.2, abs=0.01)
    assert after["base_yaw"] == pytest.approx(0.3, abs=0.01)
    assert after["shoulder"] == pytest.approx(before["shoulder"], abs=0.01)


def test_a_target_takes_the_time_that_it_is_given(shared: Shared, arm: Simulation) -> None:
    target = build(MujocoJointTargetConfigurer, params={"model": "arm"}, shared=shared)
    began = angles(shared)["elbow"]
    target.handle_data(JointTarget(names=["elbow"], positions=[began - 0.4], duration_s=4.0))
    arm.advance(1000)  # 2 s
    assert angles(shared)["elbow"] == pytest.approx(began - 0.2, abs=0.03)


def test_a_joint_is_kept_within_the_range_of_the_model_and_a_stranger_is_refused(
    shared: Shared, arm: Simulation
) -> None:
    target = build(MujocoJointTargetConfigurer, params={"model": "arm", "joints": ["elbow"]}, shared=shared)
    fed = feed(target, [{"names": ["elbow"], "positions": [9.0]}, {"names": ["shoulder"], "positions": [0.0]}])
    assert [sent.positions for sent in fed.accepted] == [[2.4]]
    assert [refused.code for refused in fed.refused] == ["safety.out_of_range"]
    (entry,) = catalogue_entries("arm", "mujoco-joint-target", [target])
    assert entry.schema_id == "mosaic/JointTarget@1"


@pytest.mark.parametrize("cause", [Silence(6.0), Stopped()])
def test_made_safe_the_arm_stays_where_it_is(shared: Shared, arm: Simulation, cause: Any) -> None:
    target = build(MujocoJointTargetConfigurer, params={"model": "arm"}, shared=shared)
    began = angles(shared)["elbow"]
    target.handle_data(JointTarget(names=["elbow"], positions=[-2.0]))
    arm.advance(150)
    fed = feed(target, [JointTarget(names=["elbow"], positions=[-2.0]), cause])
    assert fed.made_safe
    arm.advance(400)
    stopped = angles(shared)["elbow"]
    assert stopped == pytest.approx(began - 0.3, abs=0.1)
    assert target.reported_position("positions.elbow") == pytest.approx(stopped, abs=1e-3)
    arm.advance(400)
    assert angles(shared)["elbow"] == pytest.approx(stopped, abs=1e-3)


def test_an_unknown_joint_has_no_position(shared: Shared) -> None:
    target = build(MujocoJointTargetConfigurer, params={"model": "arm"}, shared=shared)
    assert target.reported_position("positions.nose") is None


def test_a_servo_behind_a_gear_goes_where_its_joint_shall(written: ModelWriter, shared: Shared) -> None:
    model = written(
        "<worldbody><body gravcomp='1'><joint name='lift' type='slide' axis='0 0 1' damping='5'/><geom size='.05'/>"
        "</body></worldbody><actuator><position joint='lift' name='m' kp='200' kv='20' gear='-2' ctrlrange='-1 1'/>"
        "</actuator>"
    )
    target = build(MujocoJointTargetConfigurer, params={"model": model, "max_speed_mps": 1.0}, shared=shared)
    assert target.limits["positions.lift"].max == 0.5
    target.handle_data(JointTarget(names=["lift"], positions=[0.25]))
    shared_simulation(shared, model).simulation.advance(1500)
    assert target.reported_position("positions.lift") == pytest.approx(0.25, abs=0.01)


def test_a_gripper_opens_as_far_as_it_is_told_in_metres_between_its_fingers(shared: Shared, arm: Simulation) -> None:
    gripper = build(MujocoGripperTargetConfigurer, params=GRIPPER, shared=shared)
    fed = feed(gripper, [GripperTarget(position=0.02, max_effort=5.0)])
    arm.advance(500)
    assert fed.accepted
    assert gripper.reported_position("position") == pytest.approx(0.02, abs=0.002)
    assert angles(shared)["left_finger"] == pytest.approx(0.01, abs=0.001)
    assert arm.model.actuator_forcerange[6].tolist() == [-5.0, 5.0]
    feed(gripper, [GripperTarget(position=0.5)])
    arm.advance(500)
    assert gripper.reported_position("position") == pytest.approx(0.08, abs=0.002)


def test_a_gripper_may_close_upwards(shared: Shared, arm: Simulation) -> None:
    params = {**GRIPPER, "closed": 0.04, "opened": 0.0}
    gripper = build(MujocoGripperTargetConfigurer, params=params, shared=shared)
    gripper.handle_data(GripperTarget(position=0.08))
    arm.advance(500)
    assert angles(shared)["left_finger"] == pytest.approx(0.0, abs=0.001)
    assert gripper.reported_position("position") == pytest.approx(0.08, abs=0.002)


def test_a_gripper_without_a_range_needs_to_be_told(written: ModelWriter) -> None:
    model = written(
        "<worldbody><body><joint name='j' type='slide'/><geom size='.05'/></body></worldbody>"
        "<actuator><position joint='j' name='grip' kp='9'/></actuator>"
    )
    with pytest.raises(ConfigError, match="has no ctrlrange: say `closed` and `opened`"):
        build(MujocoGripperTargetConfigurer, params={"model": model, "actuator": "grip"})


# -- sensors -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sensor", ["imu_gyro", "imu_acceleration"])
def test_a_gyro_and_an_accelerometer_at_one_site_are_an_imu_by_either_name(
    shared: Shared, vehicle: Simulation, sensor: str
) -> None:
    vehicle.advance(300)
    imu = sensed(shared, "vehicle", sensor)
    assert isinstance(imu, Imu)
    assert imu.linear_acceleration.z == pytest.approx(9.81, abs=0.05)  # it feels gravity upwards
    assert imu.orientation is not None
    assert imu.orientation.w == pytest.approx(1.0, abs=1e-3)


def test_a_rangefinder_measures_the_room_and_says_null_beyond_its_cutoff(shared: Shared, vehicle: Simulation) -> None:
    vehicle.reset("home")
    far = sensed(shared, "vehicle", "range")
    assert isinstance(far, Range)
    assert [far.range, far.range_max] == pytest.approx([3.81, 4.0], abs=0.02)
    vehicle.steer("turn", lambda data: {0: -20.0, 1: -20.0})  # back, until the wall is out of reach
    vehicle.advance(200)
    assert sensed(shared, "vehicle", "range").range is None


def test_a_framepos_is_a_pose_with_the_attitude_beside_it(shared: Shared, arm: Simulation) -> None:
    pose = sensed(shared, "arm", "grasp_position")
    assert isinstance(pose, Pose)
    assert [pose.position.x, pose.position.z] == pytest.approx([0.25, 0.2], abs=0.02)
    assert abs(pose.orientation.y) == pytest.approx(1.0, abs=0.01)  # the hand looks down


def test_any_other_sensor_is_told_with_its_kind_and_unit(shared: Shared, arm: Simulation) -> None:
    reading = sensed(shared, "arm", "grip_force")
    assert isinstance(reading, SensorReading)
    assert (reading.sensor, reading.kind, reading.unit, len(reading.values)) == ("grip_force", "actuatorfrc", "N", 1)


def test_a_gyro_alone_is_a_reading(written: ModelWriter, shared: Shared) -> None:
    model = written(
        "<worldbody><body><freejoint/><geom size='.1'/><site name='s'/></body></worldbody>"
        "<sensor><gyro name='g' site='s'/><framepos name='p' objtype='site' objname='s'/>"
        "<rangefinder name='r' site='s'/></sensor>"
    )
    assert sensed(shared, model, "g").unit == "rad/s"
    assert sensed(shared, model, "p").orientation.w == 1.0
    nothing = sensed(shared, model, "r", range_max_m=7.0)
    assert (nothing.range, nothing.range_max) == (None, 7.0)


@pytest.mark.parametrize(
    ("configurer", "params", "schema_id"),
    [
        (MujocoSensorConfigurer, {"model": "vehicle", "sensor": "imu_gyro"}, "mosaic/Imu@1"),
        (MujocoSensorConfigurer, {"model": "vehicle", "sensor": "range"}, "mosaic/Range@1"),
        (MujocoSensorConfigurer, {"model": "arm", "sensor": "grasp_position"}, "mosaic/Pose@1"),
        (MujocoSensorConfigurer, {"model": "arm", "sensor": "grip_force"}, "mosaic-mujoco/SensorReading@1"),
        (MujocoOdometryConfigurer, {"model": "vehicle"}, "mosaic/Odometry@1"),
        (MujocoJointsConfigurer, {"model": "vehicle"}, "mosaic/JointState@1"),
        (MujocoHealthConfigurer, {"model": "vehicle"}, "mosaic/Diagnostic@1"),
    ],
)
def test_whoever_listens_knows_the_message_and_its_period_is_kept(
    configurer: Any, params: dict[str, Any], schema_id: str
) -> None:
    sender = build(configurer, params={**params, "period_s": 0.2})
    assert catalogue_entries("x", "x", [sender])[0].schema_id == schema_id
    collect(sender, 3)
    stamps = [message.stamp_us for message in fake_host(sender).sent]
    assert [later - before for before, later in itertools.pairwise(stamps)] == [200_000, 200_000]


def test_odometry_tells_the_velocity_in_the_vehicles_own_frame(shared: Shared, vehicle: Simulation) -> None:
    odometry = build(MujocoOdometryConfigurer, params={"model": "vehicle"}, shared=shared)
    vehicle.steer("turn", lambda data: {0: -6.0, 1: 6.0})
    vehicle.advance(150)
    turning = collect(odometry, 1)[0]
    assert isinstance(turning, Odometry)
    assert turning.twist.angular.z > 1.5
    vehicle.steer("turn", lambda data: {0: 8.0, 1: 8.0})
    vehicle.advance(200)
    ahead = collect(odometry, 1)[0].twist.linear
    assert ahead.x == pytest.approx(0.48, abs=0.06)  # wheels of 6 cm
    assert math.hypot(ahead.y, ahead.z) < 0.05


# -- the simulation itself ---------------------------------------------------------------------------------------


def test_a_reset_puts_everything_back_and_an_unknown_key_frame_is_refused(shared: Shared, arm: Simulation) -> None:
    reset = build(MujocoResetConfigurer, params={"model": "arm"}, shared=shared)
    before = angles(shared)
    arm.aim({0: 1.0}, {0: 2.0})
    arm.advance(300)
    assert ask(reset, {}).answer == {"key": "home", "time_s": 0.0}
    assert angles(shared) == before
    assert ask(reset, {"key": "upright"}).answer["key"] == "upright"
    assert angles(shared)["elbow"] == 0.0
    refused = ask(reset, {"key": "uprigt"}).refused
    assert refused is not None
    assert refused.code == "channel.invalid"
    assert "did you mean 'upright'" in refused.message


def test_the_simulation_is_paused_stepped_and_sped_up_on_request(shared: Shared, arm: Simulation) -> None:
    control = build(MujocoControlConfigurer, params={"model": "arm", "paused": True}, shared=shared)
    state = ask(control, {"steps": 45}).answer
    assert (state["steps"], state["is_paused"], state["speed"]) == (45, True, 1.0)
    state = ask(control, {"pause": False, "speed": "max"}).answer
    assert (state["is_paused"], state["speed"]) == (False, None)
    assert ask(control, {"speed": 0.5}).answer["speed"] == 0.5
    assert ask(control, {"speed": -1}).refused is not None
    assert ask(control, {"steps": 10**9}).refused is not None


def report(**changes: Any) -> PaceReport:
    facts = {"time_s": 1.0, "steps": 500, "is_paused": False, "speed": 1.0, "left_out_s": 0.0, "unstable": 0}
    return PaceReport(**{**facts, **changes})


@pytest.mark.parametrize(
    ("now", "level", "words"),
    [
        (report(time_s=2.0), "ok", "runs"),
        (report(is_paused=True), "ok", "paused"),
        (report(time_s=1.4, left_out_s=0.6), "warn", "falls behind the clock"),
        (report(left_out_s=1.0, failure="out of memory"), "error", "stands still: out of memory"),
        (report(time_s=0.1, unstable=1, left_out_s=1.0), "error", "became unstable and began anew"),
    ],
)
def test_health_tells_what_happened_since_the_last_time(now: PaceReport, level: str, words: str) -> None:
    told = diagnosed("arm", report(), now, 1.0)
    assert (told.level, told.message) == (level, words)
    assert told.values["left out"] == f"{now.left_out_s:.1f} s"
    assert ("reached" in told.values) == (now.time_s >= 1.0)
