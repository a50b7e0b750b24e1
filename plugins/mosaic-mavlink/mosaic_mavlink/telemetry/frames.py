"""Turns MAVLink's axes into ours. Pure.

MAVLink: the world is north, east, down (NED), a body forward, right, down (FRD). Ours, as in REP-103: east, north, up
(ENU), and forward, left, up (FLU). Both are right-handed, so rotations stay rotations.
"""

from __future__ import annotations

import math
from typing import TypeAlias

from mosaic_core.messages import Quaternion

Triple: TypeAlias = tuple[float, float, float]
EARTH_RADIUS_M = 6_371_008.8
"""Mean radius of WGS84: within a kilometre of home the error is millimetres to centimetres."""


def enu_of_ned(north: float, east: float, down: float) -> Triple:
    """A vector of the world; its own inverse."""
    return east, north, -down


def flu_of_frd(forward: float, right: float, down: float) -> Triple:
    """A vector of the body; its own inverse."""
    return forward, -right, -down


def attitude(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Quaternion:
    """The attitude of an FLU body in the ENU world, from angles of an FRD body in the NED world: yaw is clockwise from
    north there and counter-clockwise from east here, pitch is nose up there and nose down here."""
    roll, pitch, yaw = roll_rad / 2, -pitch_rad / 2, (math.pi / 2 - yaw_rad) / 2
    cr, sr, cp, sp, cy, sy = (f(angle) for angle in (roll, pitch, yaw) for f in (math.cos, math.sin))
    return Quaternion(
        x=sr * cp * cy - cr * sp * sy,
        y=cr * sp * cy + sr * cp * sy,
        z=cr * cp * sy - sr * sp * cy,
        w=cr * cp * cy + sr * sp * sy,
    )


def in_body(world: Triple, orientation: Quaternion) -> Triple:
    """A vector of the world as the body with this ``orientation`` sees it."""
    x, y, z, w = -orientation.x, -orientation.y, -orientation.z, orientation.w
    vx, vy, vz = world
    tx, ty, tz = 2 * (y * vz - z * vy), 2 * (z * vx - x * vz), 2 * (x * vy - y * vx)
    return (
        vx + w * tx + y * tz - z * ty,
        vy + w * ty + z * tx - x * tz,
        vz + w * tz + x * ty - y * tx,
    )


def east_north_of(latitude: float, longitude: float, home: tuple[float, float]) -> tuple[float, float]:
    """Metres east and north of ``home``; all in degrees. For places near each other."""
    around = (longitude - home[1] + 180.0) % 360.0 - 180.0
    east = math.radians(around) * EARTH_RADIUS_M * math.cos(math.radians((latitude + home[0]) / 2))
    return east, math.radians(latitude - home[0]) * EARTH_RADIUS_M
