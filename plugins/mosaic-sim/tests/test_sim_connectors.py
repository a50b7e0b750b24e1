"""What the simulated robot says: through the kit, in a world that the test moves by hand."""

import math
import threading
from typing import Any

import numpy as np
import pytest

from mosaic_core import Captured, Shared
from mosaic_core.messages import Twist
from mosaic_core.runtime.configuration.catalogue_entry import catalogue_entries
from mosaic_core.testing import build, collect, fake_host, take_frames
from mosaic_sim import renderer, textures
from mosaic_sim.battery import SimBatteryConfigurer
from mosaic_sim.camera import SimCameraConfigurer
from mosaic_sim.drive import SimDrive, SimDriveParams
from mosaic_sim.gps import SimGpsConfigurer, to_wgs84
from mosaic_sim.imu import GRAVITY_MPS2, SimImuConfigurer
from mosaic_sim.laser_scan import SimLaserScanConfigurer
from mosaic_sim.live_world import shared_world
from mosaic_sim.motion import Motion
from mosaic_sim.pose import SimPoseConfigurer
from mosaic_sim.room import Room, outer_walls
from mosaic_sim.world import RobotState, World

SCAN_KEYS = {
    "angle_min", "angle_max", "angle_increment", "time_increment", "scan_time", "range_min", "range_max", "ranges",
    "intensities",
}  # fmt: skip


@pytest.fixture
def shared() -> Shared:
    return Shared()


@pytest.fixture
def world(shared: Shared) -> World:
    return shared_world(shared, 1).world


def drive(shared: Shared) -> SimDrive:
    return SimDrive(SimDriveParams(type="sim"), shared)


def test_driving_moves_the_pose_and_stopping_rests_it(shared: Shared, world: World) -> None:
    pose, wheels = build(SimPoseConfigurer, shared=shared), drive(shared)
    before = collect(pose, 1)[0].position
    wheels.apply(Twist.planar(x_mps=0.8))
    world.advance(2.0)
    moving = collect(pose, 1)[0]
    assert math.dist((before.x, before.y), (moving.position.x, moving.position.y)) > 1.0
    assert moving.twist.linear.x == pytest.approx(0.8, abs=0.01)
    wheels.stop()
    world.advance(1.5)
    rest = collect(pose, 1)[0]
    world.advance(1.0)
    assert collect(pose, 1)[0].position == rest.position
    assert rest.twist.linear.x == 0.0


def test_the_pose_has_the_keys_that_mosaic_reads(shared: Shared) -> None:
    pose = build(SimPoseConfigurer, shared=shared)
    collect(pose, 1)
    (value,) = fake_host(pose).sent_values()
    assert set(value) >= {"position", "orientation", "timestamp"}
    assert set(value["position"]) == {"x", "y", "z"}
    assert set(value["orientation"]) == {"x", "y", "z", "w"}
    assert isinstance(value["timestamp"], int)
    assert sum(part**2 for part in value["orientation"].values()) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("configurer", "schema_id", "keys"),
    [
        (SimPoseConfigurer, "mosaic/Odometry@1", {"position", "orientation", "twist", "timestamp"}),
        (SimImuConfigurer, "mosaic/Imu@1", {"angular_velocity", "linear_acceleration", "orientation", "timestamp"}),
        (SimGpsConfigurer, "mosaic/GpsFix@1", {"latitude", "longitude", "altitude", "timestamp"}),
        (SimBatteryConfigurer, "mosaic/BatteryState@1", {"percent", "voltage_v", "current_a", "charging"}),
        (SimLaserScanConfigurer, "mosaic/LaserScan@1", SCAN_KEYS),
    ],
)
def test_every_sensor_sends_a_standard_message_and_nothing_that_it_does_not_know(
    configurer: Any, schema_id: str, keys: set[str]
) -> None:
    sensor = build(configurer)
    collect(sensor, 1)
    (value,) = fake_host(sensor).sent_values()
    assert set(value) == keys
    assert catalogue_entries("x", "x", [sensor])[0].schema_id == schema_id


@pytest.mark.parametrize(
    ("configurer", "period_s"),
    [
        (SimPoseConfigurer, 0.05), (SimImuConfigurer, 0.05), (SimLaserScanConfigurer, 0.1), (SimGpsConfigurer, 0.5),
        (SimBatteryConfigurer, 1.0),
    ],
)  # fmt: skip
def test_every_sensor_keeps_its_period(configurer: Any, period_s: float) -> None:
    sensor = build(configurer)
    collect(sensor, 3)
    stamps = [message.stamp_us for message in fake_host(sensor).sent]
    assert np.diff(stamps) == pytest.approx([period_s * 1e6] * 2, rel=1e-3)


def test_a_scan_measures_the_room(shared: Shared, world: World) -> None:
    world.room = Room(3, 2, solids=tuple(outer_walls(3, 2)))
    world.state = RobotState(motion=Motion(0.0, 0.0, math.pi / 2))
    scan = collect(build(SimLaserScanConfigurer, params={"noise_m": 0.0}, shared=shared), 1)[0]
    ahead, left, right = (scan.ranges[index] for index in (180, 270, 90))
    assert (ahead, left, right) == pytest.approx((2.0, 3.0, 3.0), abs=1e-3)
    assert scan.angle_min + 180 * scan.angle_increment == pytest.approx(0.0, abs=1e-9)


def test_a_scan_has_exactly_the_keys_that_mosaic_reads_and_null_where_nothing_returns(shared: Shared) -> None:
    scanner = build(SimLaserScanConfigurer, params={"range_max_m": 2.0, "rays": 90}, shared=shared)
    scan = collect(scanner, 1)[0]
    (value,) = fake_host(scanner).sent_values()
    assert set(value) == SCAN_KEYS
    assert len(value["ranges"]) == len(value["intensities"]) == 90
    assert None in value["ranges"]
    assert all(r is None or 0.12 <= r <= 2.0 for r in scan.ranges)
    assert all((r is None) == (i == 0.0) or r is not None for r, i in zip(scan.ranges, scan.intensities, strict=True))


def test_a_standing_imu_feels_gravity_and_a_turning_one_its_rate(shared: Shared, world: World) -> None:
    quiet = {"gyro_noise_radps": 0.0, "acceleration_noise_mps2": 0.0}
    imu = build(SimImuConfigurer, params=quiet, shared=shared)
    standing = collect(imu, 1)[0]
    assert standing.linear_acceleration.z == pytest.approx(GRAVITY_MPS2)
    assert standing.angular_velocity.z == 0.0
    drive(shared).apply(Twist.planar(x_mps=0.5, yaw_radps=0.8))
    world.advance(2.0)
    turning = collect(imu, 1)[0]
    assert turning.angular_velocity.z == pytest.approx(0.8, abs=0.01)
    assert turning.linear_acceleration.y == pytest.approx(0.4, abs=0.02)


def test_noise_is_the_same_for_the_same_seed_and_label(shared: Shared) -> None:
    one, same, other = (
        [m.angular_velocity.x for m in collect(build(SimImuConfigurer, label=label, shared=shared), 3)]
        for label in ("imu", "imu", "imu_2")
    )
    assert one == same
    assert one != other


def test_the_battery_message_follows_the_world(shared: Shared, world: World) -> None:
    battery = build(SimBatteryConfigurer, shared=shared)
    full = collect(battery, 1)[0]
    drive(shared).apply(Twist.planar(x_mps=1.0))
    world.advance(2.0)
    less = collect(battery, 1)[0]
    assert less.percent < full.percent
    assert less.current_a > full.current_a
    assert not less.charging


def test_gps_moves_as_the_robot_does(shared: Shared, world: World) -> None:
    gps = build(SimGpsConfigurer, params={"noise_m": 0.0, "latitude_deg": 60.0, "longitude_deg": 10.0}, shared=shared)
    world.state = RobotState(motion=Motion(0.0, 0.0))
    origin = collect(gps, 1)[0]
    assert (origin.latitude, origin.longitude) == (60.0, 10.0)
    world.state = RobotState(motion=Motion(100.0, 50.0))
    away = collect(gps, 1)[0]
    assert (away.latitude - 60.0) * 111_412 == pytest.approx(50.0, rel=1e-3)
    assert (away.longitude - 10.0) * 55_800 == pytest.approx(100.0, rel=1e-3)


def test_a_degree_of_latitude_has_its_published_length() -> None:
    """NGA's tables of WGS84: 110 574 m at the equator, 111 694 m at the pole; a degree of longitude there 111 320 m."""
    assert 1 / to_wgs84(0, 0, 0, 1)[0] == pytest.approx(110_574, abs=2)
    assert 1 / (to_wgs84(89.9, 0, 0, 1)[0] - 89.9) == pytest.approx(111_694, abs=2)
    assert 1 / to_wgs84(0, 0, 1, 0)[1] == pytest.approx(111_320, abs=2)


def test_the_camera_shows_the_world_from_where_the_robot_is(shared: Shared, world: World) -> None:
    camera = build(SimCameraConfigurer, params={"width": 160, "height": 120}, shared=shared)
    here = take_frames(camera, 2)
    world.drive(0.0, 1.5)
    world.advance(1.0)
    (elsewhere,) = take_frames(camera, 1)
    assert isinstance(here[0], Captured)
    assert isinstance(here[1], Captured)
    assert isinstance(elsewhere, Captured)
    assert np.asarray(here[0].image).shape == (120, 160, 3)
    assert here[1].captured_at_s - here[0].captured_at_s == pytest.approx(0.05)
    lower = slice(60, None)
    assert (np.asarray(here[0].image)[lower] == np.asarray(here[1].image)[lower]).all()
    assert (np.asarray(here[0].image)[lower] != np.asarray(elsewhere.image)[lower]).mean() > 0.3


def test_all_parts_share_one_world_that_the_robot_enters(shared: Shared) -> None:
    for configurer in (SimPoseConfigurer, SimImuConfigurer, SimCameraConfigurer):
        build(configurer, shared=shared)
    with shared.entered():
        assert _world_threads() == 1
    assert _world_threads() == 0


def _world_threads() -> int:
    return sum(thread.name == "mosaic-sim-world" for thread in threading.enumerate())


def test_the_camera_hears_stop_while_its_scenery_is_drawn(shared: Shared, monkeypatch: pytest.MonkeyPatch) -> None:
    camera = build(SimCameraConfigurer, shared=shared)

    def painted(seed: int) -> textures.Atlas:
        fake_host(camera).stop()
        return textures.surfaces(seed)

    monkeypatch.setattr(renderer, "surfaces", painted)
    monkeypatch.setattr(renderer, "floor_in_steps", lambda *asked: pytest.fail("it draws on"))
    assert [*camera.frames()] == []
