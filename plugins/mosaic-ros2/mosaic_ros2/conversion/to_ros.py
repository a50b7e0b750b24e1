"""Converts commands of operators to messages of ROS, as the ``dict`` that is encoded."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from typing import Any

from mosaic_core.messages import JointTarget, Twist

AXES = "xyz"


def stamp_now() -> dict[str, int]:
    """The wall clock, as ROS' nodes on this computer stamp their messages."""
    seconds, nanoseconds = divmod(time.time_ns(), 1_000_000_000)
    return {"sec": seconds, "nanosec": nanoseconds}


def header(frame_id: str) -> dict[str, Any]:
    """A header of now."""
    return {"stamp": stamp_now(), "frame_id": frame_id}


def ros_twist(message: Twist) -> dict[str, Any]:
    """A ``geometry_msgs/Twist``."""
    return {part: {axis: getattr(getattr(message, part), axis) for axis in AXES} for part in ("linear", "angular")}


def ros_trajectory(message: JointTarget, reach_s: float) -> dict[str, Any]:
    """A ``trajectory_msgs/JointTrajectory`` of one point, to be reached in ``reach_s`` where the target says no time.
    Its stamp is 0: begin at once."""
    seconds = message.duration_s if message.duration_s is not None else reach_s
    fraction, whole = math.modf(seconds)
    duration = {"sec": int(whole), "nanosec": int(fraction * 1e9)}
    return {"joint_names": message.names, "points": [{"positions": message.positions, "time_from_start": duration}]}


def positions_in(joint_state: Mapping[str, Any]) -> dict[str, float]:
    """Where each joint is, by its name, in a ``sensor_msgs/JointState``."""
    pairs = zip(joint_state["name"], joint_state["position"].tolist(), strict=False)
    return {name: value for name, value in pairs if math.isfinite(value)}
