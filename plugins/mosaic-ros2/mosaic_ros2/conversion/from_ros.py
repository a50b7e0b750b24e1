"""Converts messages of ROS to standard messages, which have their units, their widgets and their decoding.

A converter yields one message or several: a list of transforms or of diagnostics becomes one message each. It raises
:class:`ValueError` for what can't be meant.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from mosaic_core.messages import BatteryState as Battery
from mosaic_core.messages import (
    Diagnostic,
    GpsFix,
    Imu,
    JointState,
    Joy,
    LaserScan,
    Log,
    OccupancyGrid,
    Odometry,
    Path,
    Pose,
    StandardMessage,
    Temperature,
    Transform,
    Twist,
)
from mosaic_core.messages import Range as Distance
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.delivery import DeliveryContract
from mosaic_ros2.conversion import reports, sensing
from mosaic_ros2.conversion.parts import MAX_NAME, Ros, headed, point, pose, quaternion, twist

Converter: TypeAlias = Callable[[Ros], Iterable[StandardMessage]]
WHOLE = DeliveryContract(mode=Delivery.BULK, queue_messages=1, newest_wins=True, latch=True)
"""Maps and ways are large, and the newest is all there is."""


@dataclass(frozen=True, slots=True)
class Conversion:
    """How a type of ROS becomes a standard message. ``key``: what is thinned by itself, a frame or a part of the
    robot; ``None``: the whole topic. Of events none is left out."""

    message: type[StandardMessage]
    convert: Converter
    delivery: Delivery | DeliveryContract = Delivery.LATEST
    key: Callable[[Any], Hashable] | None = None
    is_event: bool = False


def _odometry(message: Ros) -> Iterable[Odometry]:
    of = pose(message["pose"]["pose"])
    child = message["child_frame_id"][:MAX_NAME] or None
    velocity = twist(message["twist"]["twist"])
    yield Odometry(
        position=of.position, orientation=of.orientation, twist=velocity, child_frame_id=child, **headed(message)
    )


def _transform(message: Ros) -> Iterable[Transform]:
    """Frames without a name place nothing."""
    if message["header"]["frame_id"] and message["child_frame_id"]:
        moved = message["transform"]
        yield Transform(
            child_frame_id=message["child_frame_id"][:MAX_NAME].removeprefix("/"),
            translation=point(moved["translation"]),
            rotation=quaternion(moved["rotation"]),
            **headed(message),
        )


def _transforms(message: Ros) -> Iterable[Transform]:
    for one in message["transforms"]:
        yield from _transform(one)


def _path(message: Ros) -> Iterable[Path]:
    poses = [pose(one["pose"], **headed(one)) for one in message["poses"]]
    yield Path(poses=poses, **headed(message))


def _grid(message: Ros) -> Iterable[OccupancyGrid]:
    info = message["info"]
    yield OccupancyGrid(
        resolution=info["resolution"],
        width=info["width"],
        height=info["height"],
        origin=pose(info["origin"]),
        data=message["data"].tolist(),
        **headed(message),
    )


def _frames(message: Transform) -> Hashable:
    return (message.frame_id, message.child_frame_id)


CONVERSIONS: Mapping[str, Conversion] = {
    "diagnostic_msgs/msg/DiagnosticArray": Conversion(
        Diagnostic, reports.diagnostics, Delivery.RELIABLE, lambda one: one.name
    ),
    "diagnostic_msgs/msg/DiagnosticStatus": Conversion(
        Diagnostic, reports.diagnostic_alone, Delivery.RELIABLE, lambda one: one.name
    ),
    "geometry_msgs/msg/Pose": Conversion(Pose, lambda one: [pose(one)]),
    "geometry_msgs/msg/PoseStamped": Conversion(Pose, lambda one: [pose(one["pose"], **headed(one))]),
    "geometry_msgs/msg/PoseWithCovarianceStamped": Conversion(
        Pose, lambda one: [pose(one["pose"]["pose"], **headed(one))]
    ),
    "geometry_msgs/msg/TransformStamped": Conversion(Transform, _transform, Delivery.RELIABLE, _frames),
    "geometry_msgs/msg/Twist": Conversion(Twist, lambda one: [twist(one)]),
    "geometry_msgs/msg/TwistStamped": Conversion(Twist, lambda one: [twist(one["twist"])]),
    "geometry_msgs/msg/TwistWithCovarianceStamped": Conversion(Twist, lambda one: [twist(one["twist"]["twist"])]),
    "nav_msgs/msg/OccupancyGrid": Conversion(OccupancyGrid, _grid, WHOLE),
    "nav_msgs/msg/Odometry": Conversion(Odometry, _odometry),
    "nav_msgs/msg/Path": Conversion(Path, _path, WHOLE),
    "rcl_interfaces/msg/Log": Conversion(Log, reports.log_line, Delivery.RELIABLE, is_event=True),
    "sensor_msgs/msg/BatteryState": Conversion(Battery, sensing.battery),
    "sensor_msgs/msg/Imu": Conversion(Imu, sensing.imu),
    "sensor_msgs/msg/JointState": Conversion(JointState, sensing.joints),
    "sensor_msgs/msg/Joy": Conversion(Joy, sensing.stick),
    "sensor_msgs/msg/LaserScan": Conversion(LaserScan, sensing.scan),
    "sensor_msgs/msg/NavSatFix": Conversion(GpsFix, sensing.fix),
    "sensor_msgs/msg/Range": Conversion(Distance, sensing.distance),
    "sensor_msgs/msg/Temperature": Conversion(Temperature, sensing.temperature),
    "tf2_msgs/msg/TFMessage": Conversion(Transform, _transforms, Delivery.RELIABLE, _frames),
}
"""By the type of ROS. What is not here becomes JSON with the names that ROS has."""
