"""The parts that several sensor messages share, named and ordered as in ROS (REP-103: x forward, y left, z up)."""

from __future__ import annotations

import math
import time

from pydantic import Field

from mosaic_core import Message, unit


class Position(Message):
    """A place in the world frame."""

    x: float = Field(json_schema_extra=unit("m"))
    y: float = Field(json_schema_extra=unit("m"))
    z: float = Field(default=0.0, json_schema_extra=unit("m"))


class Orientation(Message):
    """A unit quaternion."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    w: float = 1.0

    @classmethod
    def of_yaw(cls, yaw_rad: float) -> Orientation:
        return cls(z=math.sin(yaw_rad / 2), w=math.cos(yaw_rad / 2))


class Velocity(Message):
    x: float = Field(default=0.0, json_schema_extra=unit("m/s"))
    y: float = Field(default=0.0, json_schema_extra=unit("m/s"))
    z: float = Field(default=0.0, json_schema_extra=unit("m/s"))


class AngularVelocity(Message):
    x: float = Field(default=0.0, json_schema_extra=unit("rad/s"))
    y: float = Field(default=0.0, json_schema_extra=unit("rad/s"))
    z: float = Field(default=0.0, json_schema_extra=unit("rad/s"))


class Acceleration(Message):
    x: float = Field(default=0.0, json_schema_extra=unit("m/s²"))
    y: float = Field(default=0.0, json_schema_extra=unit("m/s²"))
    z: float = Field(default=0.0, json_schema_extra=unit("m/s²"))


def wall_time_us() -> int:
    """The ``timestamp`` that MOSAIC's messages carry: microseconds since 1970. For display and logs only; ages are
    measured with the frame's monotonic stamp."""
    return time.time_ns() // 1000
