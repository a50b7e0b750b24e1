"""Converts where things are, both ways: poses and velocities, frames, ways and maps."""

from __future__ import annotations

from collections.abc import Iterable

from mosaic_core.messages import OccupancyGrid, Odometry, Path, Pose, Transform, Twist
from mosaic_ros2.conversion.parts import (
    MAX_NAME,
    Origin,
    Ros,
    headed,
    point,
    pose,
    quaternion,
    ros_header,
    ros_pose,
    ros_quaternion,
    ros_stamp,
    ros_twist,
    ros_vector,
    twist,
)

BASE, ODOM, MAP = "base_link", "odom", "map"
"""The frames of REP-105: of a robot, where its wheels think it is, and of the world."""


def twist_stamped(message: Twist, origin: Origin) -> Ros:
    """A ``geometry_msgs/TwistStamped``."""
    return {"header": ros_header(origin), "twist": ros_twist(message)}


def pose_stamped(message: Pose, origin: Origin) -> Ros:
    """A ``geometry_msgs/PoseStamped``."""
    return {"header": ros_header(origin, message), "pose": ros_pose(message)}


def odometry(message: Ros) -> Iterable[Odometry]:
    """Where a robot is and how it moves."""
    of = pose(message["pose"]["pose"])
    child = message["child_frame_id"][:MAX_NAME] or None
    velocity = twist(message["twist"]["twist"])
    yield Odometry(
        position=of.position, orientation=of.orientation, twist=velocity, child_frame_id=child, **headed(message)
    )


def odometry_fields(message: Odometry, origin: Origin) -> Ros:
    """A ``nav_msgs/Odometry``; how sure it is, is not known."""
    return {
        "header": ros_header(origin, message),
        "child_frame_id": message.child_frame_id or BASE,
        "pose": {"pose": ros_pose(message)},
        "twist": {"twist": ros_twist(message.twist)},
    }


def transform(message: Ros) -> Iterable[Transform]:
    """Frames without a name place nothing."""
    if message["header"]["frame_id"] and message["child_frame_id"]:
        moved = message["transform"]
        yield Transform(
            child_frame_id=message["child_frame_id"][:MAX_NAME].removeprefix("/"),
            translation=point(moved["translation"]),
            rotation=quaternion(moved["rotation"]),
            **headed(message),
        )


def transforms(message: Ros) -> Iterable[Transform]:
    """One message for each frame."""
    for one in message["transforms"]:
        yield from transform(one)


def transform_fields(message: Transform, origin: Origin) -> Ros:
    """A ``geometry_msgs/TransformStamped``."""
    moved = {"translation": ros_vector(message.translation), "rotation": ros_quaternion(message.rotation)}
    return {"header": ros_header(origin, message), "child_frame_id": message.child_frame_id, "transform": moved}


def transforms_fields(message: Transform, origin: Origin) -> Ros:
    """A ``tf2_msgs/TFMessage`` of one transform, as on ``/tf``."""
    return {"transforms": [transform_fields(message, origin)]}


def path(message: Ros) -> Iterable[Path]:
    """A way, whose poses may have stamps of their own."""
    yield Path(poses=[pose(one["pose"], **headed(one)) for one in message["poses"]], **headed(message))


def path_fields(message: Path, origin: Origin) -> Ros:
    """A ``nav_msgs/Path``; poses that name no frame lie in that of the path."""
    own = Origin(message.timestamp or origin.stamp_us, message.frame_id or origin.frame_id)
    return {"header": ros_header(own), "poses": [pose_stamped(one, own) for one in message.poses]}


def grid(message: Ros) -> Iterable[OccupancyGrid]:
    """A map."""
    info = message["info"]
    yield OccupancyGrid(
        resolution=info["resolution"],
        width=info["width"],
        height=info["height"],
        origin=pose(info["origin"]),
        data=message["data"].tolist(),
        **headed(message),
    )


def grid_fields(message: OccupancyGrid, origin: Origin) -> Ros:
    """A ``nav_msgs/OccupancyGrid``, loaded when it was made."""
    info = {
        "map_load_time": ros_stamp(message.timestamp or origin.stamp_us),
        "resolution": message.resolution,
        "width": message.width,
        "height": message.height,
        "origin": ros_pose(message.origin),
    }
    return {"header": ros_header(origin, message), "info": info, "data": message.data}
