"""MAVLink's messages as standard messages: units, signs, and what is not known."""

from __future__ import annotations

import math
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as words

from mosaic_mavlink.fake.body import FakeBody
from mosaic_mavlink.fake.reports import REPORTS, FakeInstruments
from mosaic_mavlink.telemetry.conversions import (
    battery_of,
    battery_of_system,
    global_odometry,
    gps_of,
    imu_of,
    local_odometry,
    orientation_of,
    range_of,
    range_of_finder,
)
from mosaic_mavlink.telemetry.state import diagnostic_of

STAMP_US = 1_700_000_000_000_000


def made(kind: str, body: FakeBody | None = None, **changed: Any) -> Any:
    """The message of a vehicle that is made up, with some fields changed."""
    name, fields = REPORTS[kind](FakeInstruments(body or FakeBody()), 1000)
    return getattr(words.MAVLink(None), f"{name}_encode")(**{**fields, **changed})


def test_at_rest_it_feels_gravity_upwards_and_turns_left_positively() -> None:
    imu = imu_of(made("SCALED_IMU", zgyro=-500, xacc=100, ygyro=200), None, STAMP_US)
    assert (imu.linear_acceleration.x, imu.linear_acceleration.z) == pytest.approx((0.980665, 9.80665))
    assert (imu.angular_velocity.y, imu.angular_velocity.z) == pytest.approx((-0.2, 0.5))
    assert imu.orientation is None
    assert imu.timestamp == STAMP_US


def test_px4_tells_its_imu_in_si_units() -> None:
    zeros = dict.fromkeys(("xacc", "yacc", "xgyro", "ygyro", "xmag", "ymag", "zmag"), 0.0)
    rest = dict.fromkeys(("time_usec", "abs_pressure", "diff_pressure", "pressure_alt", "temperature"), 0)
    message = words.MAVLink(None).highres_imu_encode(**zeros, **rest, zacc=-9.8, zgyro=0.25, fields_updated=63)
    imu = imu_of(message, orientation_of(made("ATTITUDE")), STAMP_US)
    assert imu.linear_acceleration.z == pytest.approx(9.8)
    assert imu.angular_velocity.z == pytest.approx(-0.25)
    assert imu.orientation is not None


def test_odometry_flies_forward_wherever_the_nose_points() -> None:
    body = FakeBody(north_m=3.0, east_m=4.0, up_m=5.0, yaw_rad=2.0, forward_mps=1.5, right_mps=-0.5, yaw_radps=0.3)
    odometry = local_odometry(made("LOCAL_POSITION_NED", body), made("ATTITUDE", body), STAMP_US)
    assert (odometry.position.x, odometry.position.y, odometry.position.z) == (4.0, 3.0, 5.0)
    linear, angular = odometry.twist.linear, odometry.twist.angular
    assert (linear.x, linear.y, linear.z, angular.z) == pytest.approx((1.5, 0.5, 0.0, -0.3))
    assert (odometry.frame_id, odometry.child_frame_id) == ("odom", "base_link")


def test_a_global_position_is_metres_from_home() -> None:
    body = FakeBody(north_m=100.0, east_m=-50.0, up_m=20.0)
    home = made("HOME_POSITION")
    place = home.latitude / 1e7, home.longitude / 1e7
    odometry = global_odometry(made("GLOBAL_POSITION_INT", body), made("ATTITUDE", body), place, STAMP_US)
    found = odometry.position.x, odometry.position.y, odometry.position.z
    assert found == pytest.approx((-50.0, 100.0, 20.0), abs=0.1)
    assert odometry.frame_id == "map"


def test_a_fix_and_none() -> None:
    fix = gps_of(made("GPS_RAW_INT", vel=250, cog=9000), STAMP_US)
    assert (fix.latitude, fix.longitude, fix.altitude) == (47.3977, 8.5456, 488.0)
    assert (fix.fix, fix.satellites, fix.hdop, fix.accuracy_m) == ("gps", 10, 1.21, 1.8)
    assert fix.speed_mps == 2.5
    assert fix.course_rad == pytest.approx(math.pi / 2)
    none = gps_of(made("GPS_RAW_INT", fix_type=0, satellites_visible=255, eph=0xFFFF, epv=0xFFFF), STAMP_US)
    assert (none.latitude, none.longitude, none.altitude, none.fix) == (None, None, None, "none")
    assert (none.satellites, none.hdop, none.vdop, none.speed_mps) == (None, None, None, None)


def test_the_cells_of_a_battery_add_up_and_what_is_unknown_is_none() -> None:
    full = battery_of(made("BATTERY_STATUS"), STAMP_US)
    assert (full.percent, full.voltage_v, full.current_a, full.temperature_c) == (87.0, 16.0, 12.5, 25.1)
    unknown: dict[str, Any] = {
        "battery_remaining": -1,
        "voltages": [0xFFFF] * 10,
        "current_battery": -1,
        "temperature": 0x7FFF,
    }
    empty = battery_of(made("BATTERY_STATUS", **unknown, charge_state=7), STAMP_US)
    assert (empty.percent, empty.voltage_v, empty.current_a, empty.temperature_c) == (None, None, None, None)
    assert empty.charging
    system = battery_of_system(made("SYS_STATUS"), STAMP_US)
    assert (system.percent, system.voltage_v, system.current_a) == (87.0, 16.0, 12.5)
    blind = made("SYS_STATUS", voltage_battery=0xFFFF, current_battery=-1, battery_remaining=-1)
    assert battery_of_system(blind, STAMP_US).voltage_v is None


def test_beyond_its_limits_a_distance_sensor_saw_nothing() -> None:
    near = range_of(made("DISTANCE_SENSOR", FakeBody(up_m=3.0)), STAMP_US)
    assert (near.range, near.range_min, near.range_max, near.radiation) == (3.25, 0.2, 40.0, "laser")
    assert range_of(made("DISTANCE_SENSOR", current_distance=4001, type=9), STAMP_US).range is None
    finder = words.MAVLink(None).rangefinder_encode(distance=2.5, voltage=0.0)
    assert range_of_finder(finder, 10.0, STAMP_US).range == 2.5
    assert range_of_finder(finder, 2.0, STAMP_US).range is None


def test_a_diagnostic_names_the_parts_that_are_unwell() -> None:
    message = made("SYS_STATUS", onboard_control_sensors_health=words.MAV_SYS_STATUS_SENSOR_GPS)
    told = diagnostic_of(message, "active", "LOITER", STAMP_US)
    assert (told.level, told.message) == ("warn", "3d gyro, 3d accel, battery")
    assert told.values["load"] == "25.0 %"
    assert diagnostic_of(made("SYS_STATUS"), "active", "LOITER", STAMP_US).level == "ok"
    assert diagnostic_of(made("SYS_STATUS"), "critical", "RTL", STAMP_US).level == "error"
