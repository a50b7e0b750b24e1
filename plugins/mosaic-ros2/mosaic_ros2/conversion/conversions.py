"""Lists which types of ROS are standard messages, and how they become each other.

A converter from ROS yields one message or several: a list of transforms or of diagnostics becomes one message each. One
towards ROS gives the fields that are encoded. Both raise :class:`ValueError` for what can't be meant.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from mosaic_core.messages import (
    BatteryState,
    Diagnostic,
    GpsFix,
    GripperTarget,
    ImageAnnotations,
    Imu,
    JointState,
    JointTarget,
    Joy,
    LaserScan,
    Log,
    OccupancyGrid,
    Odometry,
    Path,
    Pose,
    Range,
    StandardMessage,
    Temperature,
    Transform,
    Twist,
)
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.delivery import DeliveryContract
from mosaic_ros2.conversion import annotations, joints, places, reports, sensing
from mosaic_ros2.conversion.parts import Origin, Ros, headed, pose, ros_pose, ros_twist, twist
from mosaic_ros2.conversion.places import BASE, MAP, ODOM

FromRos: TypeAlias = Callable[[Ros], Iterable[StandardMessage]]
ToRos: TypeAlias = Callable[[Any, Origin], Ros]
WHOLE = DeliveryContract(mode=Delivery.BULK, queue_messages=1, newest_wins=True, latch=True)
"""Maps and ways are large, and the newest is all there is."""


@dataclass(frozen=True, slots=True)
class Conversion:
    """How a type of ROS and a standard message become each other.

    ``fields``: towards ROS; ``None``: the message says too little. ``frame_id``: the frame that is meant where a
    message names none. ``key``: what is thinned by itself, a frame or a part of the robot; ``None``: the whole
    topic. Of events none is left out.
    """

    message: type[StandardMessage]
    convert: FromRos
    fields: ToRos | None = None
    frame_id: str = ""
    delivery: Delivery | DeliveryContract = Delivery.LATEST
    key: Callable[[Any], Hashable] | None = None
    is_event: bool = False


def _frames(message: Transform) -> Hashable:
    return (message.frame_id, message.child_frame_id)


def _part(message: Diagnostic) -> Hashable:
    return message.name


RELIABLE = Delivery.RELIABLE
CONVERSIONS: Mapping[str, Conversion] = {
    "control_msgs/msg/GripperCommand": Conversion(GripperTarget, joints.gripper, joints.gripper_fields),
    "diagnostic_msgs/msg/DiagnosticArray": Conversion(
        Diagnostic, reports.diagnostics, reports.diagnostics_fields, delivery=RELIABLE, key=_part
    ),
    "diagnostic_msgs/msg/DiagnosticStatus": Conversion(
        Diagnostic, reports.diagnostic_alone, reports.diagnostic_fields, delivery=RELIABLE, key=_part
    ),
    "foxglove_msgs/msg/ImageAnnotations": Conversion(
        ImageAnnotations, annotations.annotations, annotations.annotations_fields
    ),
    "geometry_msgs/msg/Pose": Conversion(Pose, lambda one: [pose(one)], lambda one, origin: ros_pose(one)),
    "geometry_msgs/msg/PoseStamped": Conversion(
        Pose, lambda one: [pose(one["pose"], **headed(one))], places.pose_stamped, MAP
    ),
    "geometry_msgs/msg/PoseWithCovarianceStamped": Conversion(
        Pose, lambda one: [pose(one["pose"]["pose"], **headed(one))]
    ),
    "geometry_msgs/msg/TransformStamped": Conversion(
        Transform, places.transform, places.transform_fields, delivery=RELIABLE, key=_frames
    ),
    "geometry_msgs/msg/Twist": Conversion(Twist, lambda one: [twist(one)], lambda one, origin: ros_twist(one)),
    "geometry_msgs/msg/TwistStamped": Conversion(Twist, lambda one: [twist(one["twist"])], places.twist_stamped, BASE),
    "geometry_msgs/msg/TwistWithCovarianceStamped": Conversion(Twist, lambda one: [twist(one["twist"]["twist"])]),
    "nav_msgs/msg/OccupancyGrid": Conversion(OccupancyGrid, places.grid, places.grid_fields, MAP, WHOLE),
    "nav_msgs/msg/Odometry": Conversion(Odometry, places.odometry, places.odometry_fields, ODOM),
    "nav_msgs/msg/Path": Conversion(Path, places.path, places.path_fields, MAP, WHOLE),
    "rcl_interfaces/msg/Log": Conversion(Log, reports.log_line, reports.log_fields, delivery=RELIABLE, is_event=True),
    "sensor_msgs/msg/BatteryState": Conversion(BatteryState, sensing.battery, sensing.battery_fields),
    "sensor_msgs/msg/Imu": Conversion(Imu, sensing.imu, sensing.imu_fields, BASE),
    "sensor_msgs/msg/JointState": Conversion(JointState, joints.joint_state, joints.joint_state_fields),
    "sensor_msgs/msg/Joy": Conversion(Joy, sensing.stick, sensing.stick_fields),
    "sensor_msgs/msg/LaserScan": Conversion(LaserScan, sensing.scan, sensing.scan_fields),
    "sensor_msgs/msg/NavSatFix": Conversion(GpsFix, sensing.fix, sensing.fix_fields),
    "sensor_msgs/msg/Range": Conversion(Range, sensing.distance, sensing.distance_fields),
    "sensor_msgs/msg/Temperature": Conversion(Temperature, sensing.temperature, sensing.temperature_fields),
    "tf2_msgs/msg/TFMessage": Conversion(
        Transform, places.transforms, places.transforms_fields, delivery=RELIABLE, key=_frames
    ),
    "trajectory_msgs/msg/JointTrajectory": Conversion(JointTarget, joints.joint_target, joints.joint_target_fields),
}
"""By the type of ROS. What is not here becomes JSON with the names that ROS has."""
