"""Converts the parts that many ROS messages share, both ways: stamps, frames, vectors, rotations."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from mosaic_core.messages import AngularVelocity, LinearVelocity, Point, Pose, Quaternion, Twist, Vector3, wall_time_us

Ros: TypeAlias = Mapping[str, Any]
"""A message of ROS, decoded, or about to be encoded."""

LEAST_LENGTH = 1e-6
MAX_NAME = 128


@dataclass(frozen=True, slots=True)
class Origin:
    """When and where a message was made, for one that does not say so itself. ``stamp_us`` 0: nobody knows."""

    stamp_us: int = 0
    frame_id: str = ""

    @classmethod
    def now(cls, frame_id: str = "") -> Origin:
        """By the wall clock, as ROS' nodes on this computer stamp their messages."""
        return cls(wall_time_us(), frame_id)

    @classmethod
    def at(cls, monotonic_s: float, frame_id: str = "") -> Origin:
        """At this moment of the robot's monotonic clock."""
        return cls(wall_time_us() - round((time.monotonic() - monotonic_s) * 1e6), frame_id)


def stamp_us(stamp: Ros) -> int | None:
    """Microseconds since 1970; ``None`` where nobody stamped it."""
    sent_us = int(stamp["sec"]) * 1_000_000 + int(stamp["nanosec"]) // 1000
    return sent_us if sent_us > 0 else None


def ros_stamp(since_1970_us: int) -> Ros:
    """A ``builtin_interfaces/Time``."""
    seconds, microseconds = divmod(since_1970_us, 1_000_000)
    return {"sec": seconds, "nanosec": microseconds * 1000}


def headed(message: Ros) -> dict[str, Any]:
    """``timestamp`` and ``frame_id`` of a message with a header."""
    header = message["header"]
    return {"timestamp": stamp_us(header["stamp"]), "frame_id": header["frame_id"][:MAX_NAME] or None}


def ros_header(origin: Origin, message: object = None) -> Ros:
    """A header: what the message says of time and frame, else its origin."""
    stamp = getattr(message, "timestamp", None) or origin.stamp_us
    frame_id = getattr(message, "frame_id", None) or origin.frame_id
    return {"stamp": ros_stamp(stamp), "frame_id": frame_id}


def finite(value: float) -> float | None:
    """``None`` for NaN and the infinities."""
    return value if math.isfinite(value) else None


def unknown_as_nan(value: float | None) -> float:
    """NaN for ``None``."""
    return math.nan if value is None else value


def point(xyz: Ros) -> Point:
    """A place, or a way."""
    return Point(x=xyz["x"], y=xyz["y"], z=xyz["z"])


def ros_vector(vector: Vector3) -> Ros:
    """A ``Vector3`` or ``Point``."""
    return {"x": vector.x, "y": vector.y, "z": vector.z}


def quaternion(xyzw: Ros) -> Quaternion:
    """A rotation of length 1; all zeros, as a message has it that nobody filled in, are none."""
    length = math.hypot(xyzw["x"], xyzw["y"], xyzw["z"], xyzw["w"])
    if length < LEAST_LENGTH:
        return Quaternion()
    return Quaternion(**{axis: xyzw[axis] / length for axis in "xyzw"})


def ros_quaternion(rotation: Quaternion) -> Ros:
    """A ``Quaternion``."""
    return {"x": rotation.x, "y": rotation.y, "z": rotation.z, "w": rotation.w}


def twist(message: Ros) -> Twist:
    """A velocity."""
    linear, angular = message["linear"], message["angular"]
    return Twist(
        linear=LinearVelocity(**{axis: linear[axis] for axis in "xyz"}),
        angular=AngularVelocity(**{axis: angular[axis] for axis in "xyz"}),
    )


def ros_twist(message: Twist) -> Ros:
    """A ``Twist``."""
    return {"linear": ros_vector(message.linear), "angular": ros_vector(message.angular)}


def pose(message: Ros, **more: Any) -> Pose:
    """A place and an attitude."""
    return Pose(position=point(message["position"]), orientation=quaternion(message["orientation"]), **more)


def ros_pose(message: Pose) -> Ros:
    """A ``Pose``."""
    return {"position": ros_vector(message.position), "orientation": ros_quaternion(message.orientation)}
