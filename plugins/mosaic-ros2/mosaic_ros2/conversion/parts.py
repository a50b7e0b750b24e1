"""Converts the parts that many ROS messages share: stamps, frames, vectors, rotations."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, TypeAlias

from mosaic_core.messages import AngularVelocity, LinearVelocity, Point, Pose, Quaternion, Twist

Ros: TypeAlias = Mapping[str, Any]
"""A message of ROS, decoded."""

LEAST_LENGTH = 1e-6
MAX_NAME = 128


def stamp_us(stamp: Ros) -> int | None:
    """Microseconds since 1970; ``None`` where nobody stamped it."""
    sent_us = int(stamp["sec"]) * 1_000_000 + int(stamp["nanosec"]) // 1000
    return sent_us if sent_us > 0 else None


def headed(message: Ros) -> dict[str, Any]:
    """``timestamp`` and ``frame_id`` of a message with a header."""
    header = message["header"]
    return {"timestamp": stamp_us(header["stamp"]), "frame_id": header["frame_id"][:MAX_NAME] or None}


def finite(value: float) -> float | None:
    """``None`` for NaN and the infinities."""
    return value if math.isfinite(value) else None


def point(xyz: Ros) -> Point:
    """A place, or a way."""
    return Point(x=xyz["x"], y=xyz["y"], z=xyz["z"])


def quaternion(xyzw: Ros) -> Quaternion:
    """A rotation of length 1; all zeros, as a message has it that nobody filled in, are none."""
    length = math.hypot(xyzw["x"], xyzw["y"], xyzw["z"], xyzw["w"])
    if length < LEAST_LENGTH:
        return Quaternion()
    return Quaternion(**{axis: xyzw[axis] / length for axis in "xyzw"})


def twist(message: Ros) -> Twist:
    """A velocity."""
    linear, angular = message["linear"], message["angular"]
    return Twist(
        linear=LinearVelocity(**{axis: linear[axis] for axis in "xyz"}),
        angular=AngularVelocity(**{axis: angular[axis] for axis in "xyz"}),
    )


def pose(message: Ros, **more: Any) -> Pose:
    """A place and an attitude."""
    return Pose(position=point(message["position"]), orientation=quaternion(message["orientation"]), **more)
