"""Standard messages: common quantities of robots in SI units and the frames of REP-103 and REP-105.

Whoever sends or receives one has its units, its widget, its decoding and, of a command, what moves, for nothing. A
message of one's own stays as easy: derive from :class:`~mosaic_core.contract.params.Message`, or from one of these to
add fields.
"""

from collections.abc import Mapping

from mosaic_core.messages.geometry import (
    STANDSTILL,
    AngularVelocity,
    LinearAcceleration,
    LinearVelocity,
    OccupancyGrid,
    Odometry,
    Path,
    Point,
    Pose,
    Quaternion,
    Transform,
    Twist,
    Vector3,
)
from mosaic_core.messages.joints import GripperTarget, JointState, JointTarget
from mosaic_core.messages.reports import (
    Diagnostic,
    ImageAnnotations,
    ImageBox,
    ImageLine,
    ImagePoint,
    ImageText,
    Log,
)
from mosaic_core.messages.sensors import BatteryState, GpsFix, Imu, Joy, LaserScan, Range, Temperature
from mosaic_core.messages.standard import StandardMessage, wall_time_us

STANDARD_MESSAGES: Mapping[str, type[StandardMessage]] = {
    one.schema_id: one
    for one in (
        Twist, Pose, Odometry, Transform, Path, OccupancyGrid, JointState, JointTarget, GripperTarget, Imu, GpsFix,
        LaserScan, Range, Joy, Temperature, BatteryState, ImageAnnotations, Log, Diagnostic,
    )
}  # fmt: skip
"""All of them by their schema id."""

__all__ = [
    "STANDARD_MESSAGES",
    "STANDSTILL",
    "AngularVelocity",
    "BatteryState",
    "Diagnostic",
    "GpsFix",
    "GripperTarget",
    "ImageAnnotations",
    "ImageBox",
    "ImageLine",
    "ImagePoint",
    "ImageText",
    "Imu",
    "JointState",
    "JointTarget",
    "Joy",
    "LaserScan",
    "LinearAcceleration",
    "LinearVelocity",
    "Log",
    "OccupancyGrid",
    "Odometry",
    "Path",
    "Point",
    "Pose",
    "Quaternion",
    "Range",
    "StandardMessage",
    "Temperature",
    "Transform",
    "Twist",
    "Vector3",
    "wall_time_us",
]
