"""Converts how joints and grippers stand, and where they shall go, both ways."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from mosaic_core.messages import GripperTarget, JointState, JointTarget
from mosaic_ros2.conversion.parts import Origin, Ros, headed, ros_header


def joint_state(message: Ros) -> Iterable[JointState]:
    """A list that has not one finite value for each name is not known."""
    names = message["name"]

    def known(values: Any) -> list[float]:
        return values.tolist() if len(values) == len(names) and np.isfinite(values).all() else []

    yield JointState(
        names=names,
        positions=known(message["position"]),
        velocities=known(message["velocity"]),
        efforts=known(message["effort"]),
        timestamp=headed(message)["timestamp"],
    )


def joint_state_fields(message: JointState, origin: Origin) -> Ros:
    """A ``sensor_msgs/JointState``."""
    return {
        "header": ros_header(origin, message),
        "name": message.names,
        "position": message.positions,
        "velocity": message.velocities,
        "effort": message.efforts,
    }


def positions_in(joint_state: Ros) -> dict[str, float]:
    """Where each joint is, by its name, in a ``sensor_msgs/JointState``."""
    pairs = zip(joint_state["name"], joint_state["position"].tolist(), strict=False)
    return {name: value for name, value in pairs if math.isfinite(value)}


def joint_target(message: Ros) -> Iterable[JointTarget]:
    """The last point of a trajectory: where the joints shall be in the end. One without points stops them where they
    are, and names no target."""
    if message["points"]:
        last = message["points"][-1]
        lasts = last["time_from_start"]
        duration_s = lasts["sec"] + lasts["nanosec"] / 1e9
        yield JointTarget(
            names=message["joint_names"],
            positions=last["positions"].tolist(),
            duration_s=duration_s if duration_s > 0 else None,
        )


def trajectory(message: JointTarget, reach_s: float) -> Ros:
    """A ``trajectory_msgs/JointTrajectory`` of one point, to be reached in ``reach_s`` where the target says no time;
    0: as fast as its controller allows. Its stamp is 0: begin at once."""
    seconds = message.duration_s if message.duration_s is not None else reach_s
    fraction, whole = math.modf(seconds)
    duration = {"sec": int(whole), "nanosec": int(fraction * 1e9)}
    return {"joint_names": message.names, "points": [{"positions": message.positions, "time_from_start": duration}]}


def joint_target_fields(message: JointTarget, origin: Origin) -> Ros:
    """The same where nobody says how long a way may take."""
    return trajectory(message, 0.0)


def gripper(message: Ros) -> Iterable[GripperTarget]:
    """An effort of 0 leaves it to the gripper, as ROS' controllers take it."""
    yield GripperTarget(position=message["position"], max_effort=message["max_effort"] or None)


def gripper_fields(message: GripperTarget, origin: Origin) -> Ros:
    """A ``control_msgs/GripperCommand``."""
    return {"position": message.position, "max_effort": message.max_effort or 0.0}
