"""Makes standard messages of MAVLink's. Pure; ``stamp_us``: when the message came.

MAVLink writes "unknown" as the largest or a negative number of a field: here it is ``None``.
"""

from __future__ import annotations

import math
from typing import Any, Literal

from mosaic_core.messages import (
    AngularVelocity,
    BatteryState,
    GpsFix,
    Imu,
    LinearAcceleration,
    LinearVelocity,
    Odometry,
    Point,
    Quaternion,
    Range,
    Twist,
)
from mosaic_mavlink.telemetry.frames import Triple, attitude, east_north_of, enu_of_ned, flu_of_frd, in_body

STANDARD_GRAVITY = 9.80665
UINT8, UINT16, INT16 = 0xFF, 0xFFFF, 0x7FFF
_FIXES = {2: "2d", 3: "gps", 4: "dgps", 5: "float-rtk", 6: "rtk", 7: "static", 8: "ppp"}
_RADIATION: dict[int, Literal["laser", "ultrasound", "infrared", "radar"]] = {
    0: "laser", 1: "ultrasound", 2: "infrared", 3: "radar",
}  # fmt: skip
RATE_2_SIGMA = 2.0
"""``h_acc`` is a standard deviation; 95 of 100 lie within two of them."""


def orientation_of(message: Any) -> Quaternion:
    """The orientation that an ``ATTITUDE`` tells."""
    return attitude(message.roll, message.pitch, message.yaw)


def imu_of(message: Any, orientation: Quaternion | None, stamp_us: int) -> Imu:
    """An ``Imu`` of ``HIGHRES_IMU`` (SI units), or of ``SCALED_IMU`` or ``RAW_IMU`` (milli-g and mrad/s, as ArduPilot
    fills both)."""
    is_si = message.get_type() == "HIGHRES_IMU"
    acceleration, rate = (1.0, 1.0) if is_si else (STANDARD_GRAVITY / 1000, 1 / 1000)
    ax, ay, az = flu_of_frd(message.xacc * acceleration, message.yacc * acceleration, message.zacc * acceleration)
    wx, wy, wz = flu_of_frd(message.xgyro * rate, message.ygyro * rate, message.zgyro * rate)
    return Imu(
        linear_acceleration=LinearAcceleration(x=ax, y=ay, z=az),
        angular_velocity=AngularVelocity(x=wx, y=wy, z=wz),
        orientation=orientation,
        timestamp=stamp_us,
    )


def local_odometry(position: Any, turning: Any, stamp_us: int) -> Odometry:
    """Of ``LOCAL_POSITION_NED`` and ``ATTITUDE``: metres from where the autopilot's estimator began."""
    place = enu_of_ned(position.x, position.y, position.z)
    return _odometry(place, enu_of_ned(position.vx, position.vy, position.vz), turning, stamp_us, "odom")


def global_odometry(position: Any, turning: Any, home: tuple[float, float], stamp_us: int) -> Odometry:
    """Of ``GLOBAL_POSITION_INT`` and ``ATTITUDE``: metres east and north of ``home`` (degrees), and above the height
    of home."""
    east, north = east_north_of(position.lat / 1e7, position.lon / 1e7, home)
    velocity = enu_of_ned(position.vx / 100, position.vy / 100, position.vz / 100)
    return _odometry((east, north, position.relative_alt / 1000), velocity, turning, stamp_us, "map")


def _odometry(place: Triple, velocity: Triple, turning: Any, stamp_us: int, frame_id: str) -> Odometry:
    orientation = orientation_of(turning)
    vx, vy, vz = in_body(velocity, orientation)
    wx, wy, wz = flu_of_frd(turning.rollspeed, turning.pitchspeed, turning.yawspeed)
    return Odometry(
        position=Point(x=place[0], y=place[1], z=place[2]),
        orientation=orientation,
        twist=Twist(linear=LinearVelocity(x=vx, y=vy, z=vz), angular=AngularVelocity(x=wx, y=wy, z=wz)),
        frame_id=frame_id,
        child_frame_id="base_link",
        timestamp=stamp_us,
    )


def gps_of(message: Any, stamp_us: int) -> GpsFix:
    """Of ``GPS_RAW_INT``. Without a fix the place is unknown, whatever its numbers say."""
    has_fix = message.fix_type >= 2
    ellipsoid_mm = getattr(message, "alt_ellipsoid", 0)
    h_acc_mm = getattr(message, "h_acc", 0)
    return GpsFix(
        latitude=_within(message.lat / 1e7, 90) if has_fix else None,
        longitude=_within(message.lon / 1e7, 180) if has_fix else None,
        altitude=(ellipsoid_mm or message.alt) / 1000 if message.fix_type >= 3 else None,
        fix=_FIXES.get(message.fix_type, "none"),
        satellites=None if message.satellites_visible == UINT8 else message.satellites_visible,
        hdop=None if message.eph == UINT16 else message.eph / 100,
        vdop=None if message.epv == UINT16 else message.epv / 100,
        speed_mps=None if message.vel == UINT16 or not has_fix else message.vel / 100,
        course_rad=None if message.cog == UINT16 or not has_fix else math.radians(message.cog / 100),
        accuracy_m=RATE_2_SIGMA * h_acc_mm / 1000 if h_acc_mm and has_fix else None,
        timestamp=stamp_us,
    )


def _within(value: float, bound: float) -> float:
    return max(-bound, min(bound, value))


def battery_of(message: Any, stamp_us: int) -> BatteryState:
    """Of ``BATTERY_STATUS``, whose cells add up."""
    cells_mv = [one for one in message.voltages if one != UINT16]
    charge = getattr(message, "charge_state", 0)
    return BatteryState(
        percent=_percent(message.battery_remaining),
        voltage_v=sum(cells_mv) / 1000 if cells_mv else None,
        current_a=None if message.current_battery == -1 else message.current_battery / 100,
        charging=None if not charge else charge == 7,
        temperature_c=None if message.temperature == INT16 else message.temperature / 100,
        timestamp=stamp_us,
    )


def battery_of_system(message: Any, stamp_us: int) -> BatteryState:
    """Of ``SYS_STATUS``, where a vehicle sends no ``BATTERY_STATUS``."""
    return BatteryState(
        percent=_percent(message.battery_remaining),
        voltage_v=None if message.voltage_battery == UINT16 else message.voltage_battery / 1000,
        current_a=None if message.current_battery == -1 else message.current_battery / 100,
        timestamp=stamp_us,
    )


def _percent(remaining: int) -> float | None:
    return float(min(remaining, 100)) if remaining >= 0 else None


def range_of(message: Any, stamp_us: int) -> Range:
    """Of ``DISTANCE_SENSOR``; beyond its limits it saw nothing."""
    low_m, high_m, distance_m = (
        one / 100 for one in (message.min_distance, message.max_distance, message.current_distance)
    )
    view = getattr(message, "horizontal_fov", 0.0)
    return Range(
        range=distance_m if low_m <= distance_m <= high_m else None,
        range_min=low_m,
        range_max=high_m,
        field_of_view=view if view > 0 and math.isfinite(view) else None,
        radiation=_RADIATION.get(message.type),
        timestamp=stamp_us,
    )


def range_of_finder(message: Any, max_m: float, stamp_us: int) -> Range:
    """Of ArduPilot's older ``RANGEFINDER``, which does not tell its limits."""
    near = 0.0 < message.distance <= max_m
    return Range(range=message.distance if near else None, range_max=max_m, timestamp=stamp_us)
