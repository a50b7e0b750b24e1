"""Positions and velocities. Axes as in REP-103: x forward, y left, z up; angles count counter-clockwise."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Self

from pydantic import Field, model_validator

from mosaic_core.contract.params import unit
from mosaic_core.messages.standard import Metres, StandardMessage, frame, stamp
from mosaic_core.words.limits import MotionKind

MAX_POSES = 10_000
MAX_CELLS = 4_000_000
UNIT_TOLERANCE = 0.01
"""What rounding leaves of a rotation's length of 1."""

MetresPerSecond = Annotated[float, Field(strict=True, json_schema_extra=unit("m/s"))]
RadiansPerSecond = Annotated[float, Field(strict=True, json_schema_extra=unit("rad/s"))]
MetresPerSecond2 = Annotated[float, Field(json_schema_extra=unit("m/s²"))]


class Vector3(StandardMessage):
    """Three numbers; those that are absent are 0. One that has none of them, but other keys, is misspelt."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0

    @model_validator(mode="before")
    @classmethod
    def _has_a_component(cls, data: Any) -> Any:
        if isinstance(data, dict) and data and not data.keys() & {"x", "y", "z"}:
            raise ValueError(f"needs x, y or z, has only {_names(data)}")
        return data


class Point(Vector3):
    """A place, or a way from one to another."""

    x: Metres
    y: Metres
    z: Metres = 0.0


class LinearVelocity(Vector3):
    """Metres per second: x forward, y left, z up."""

    x: MetresPerSecond = 0.0
    y: MetresPerSecond = 0.0
    z: MetresPerSecond = 0.0


class AngularVelocity(Vector3):
    """Radians per second; positive z turns left."""

    x: RadiansPerSecond = 0.0
    y: RadiansPerSecond = 0.0
    z: RadiansPerSecond = 0.0


class LinearAcceleration(Vector3):
    """Metres per second squared."""

    x: MetresPerSecond2 = 0.0
    y: MetresPerSecond2 = 0.0
    z: MetresPerSecond2 = 0.0


class Quaternion(StandardMessage):
    """A rotation: a quaternion of length 1. Absent: none."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    w: float = 1.0

    @model_validator(mode="after")
    def _is_a_rotation(self) -> Self:
        length = math.hypot(self.x, self.y, self.z, self.w)
        if abs(length - 1.0) > UNIT_TOLERANCE:
            raise ValueError(f"a rotation has the length 1, this one {length:g}")
        return self

    @classmethod
    def of_yaw(cls, yaw_rad: float) -> Quaternion:
        """A turn to the left around z."""
        return cls(z=math.sin(yaw_rad / 2), w=math.cos(yaw_rad / 2))


class Twist(StandardMessage):
    """A velocity: ``{"linear": {"x", "y", "z"}, "angular": {"x", "y", "z"}}``.

    Absent components are 0, but one of the two must be there: what is no velocity at all (``{}``, a misspelt key, a
    string, NaN) is refused instead of being taken for a stop.
    """

    schema_id: ClassVar[str] = "mosaic/Twist@1"
    given_in: ClassVar[str] = "`base_link`: the frame of what moves"
    shape_from: ClassVar[str] = "geometry_msgs; REP-103"
    ros_type: ClassVar[str] = "geometry_msgs/msg/Twist"
    motion_kinds: ClassVar[Mapping[str, MotionKind]] = {
        f"{part}.{axis}": "velocity" for part in ("linear", "angular") for axis in ("x", "y", "z")
    }
    linear: LinearVelocity = LinearVelocity()
    angular: AngularVelocity = AngularVelocity()

    @model_validator(mode="before")
    @classmethod
    def _is_a_twist(cls, data: Any) -> Any:
        if isinstance(data, dict) and not data.keys() & {"linear", "angular"}:
            raise ValueError(f"a Twist needs linear or angular, has {_names(data) if data else 'neither'}")
        return data

    @classmethod
    def planar(cls, x_mps: float = 0.0, y_mps: float = 0.0, yaw_radps: float = 0.0) -> Twist:
        """The velocity of a base on a floor: forward, to the left, and turning left."""
        return cls(linear=LinearVelocity(x=x_mps, y=y_mps), angular=AngularVelocity(z=yaw_radps))


STANDSTILL = Twist.planar()
"""Every velocity is 0."""


class Pose(StandardMessage):
    """A place and an attitude."""

    schema_id: ClassVar[str] = "mosaic/Pose@1"
    given_in: ClassVar[str] = "`frame_id`; absent: a world-fixed frame such as `map`"
    shape_from: ClassVar[str] = "geometry_msgs; REP-103, REP-105"
    ros_type: ClassVar[str] = "geometry_msgs/msg/PoseStamped"
    position: Point
    orientation: Quaternion = Quaternion()
    frame_id: str | None = frame()
    timestamp: int | None = stamp()


class Odometry(Pose):
    """Where a robot is and how it moves."""

    schema_id: ClassVar[str] = "mosaic/Odometry@1"
    given_in: ClassVar[str] = "pose in `frame_id` (`odom`), twist in `child_frame_id` (`base_link`)"
    shape_from: ClassVar[str] = "nav_msgs, without its covariances; REP-105"
    ros_type: ClassVar[str] = "nav_msgs/msg/Odometry"
    twist: Twist
    child_frame_id: str | None = frame("The frame of the twist.")


class Transform(StandardMessage):
    """Where a frame lies in another one."""

    schema_id: ClassVar[str] = "mosaic/Transform@1"
    given_in: ClassVar[str] = "`frame_id`; places `child_frame_id` in it"
    shape_from: ClassVar[str] = "geometry_msgs; REP-105"
    ros_type: ClassVar[str] = "geometry_msgs/msg/TransformStamped"
    frame_id: str = Field(min_length=1, max_length=128, description="The parent.")
    child_frame_id: str = Field(min_length=1, max_length=128, description="The child, which this places.")
    translation: Point
    rotation: Quaternion = Quaternion()
    timestamp: int | None = stamp()


class Path(StandardMessage):
    """A way: poses in the order in which they are passed."""

    schema_id: ClassVar[str] = "mosaic/Path@1"
    given_in: ClassVar[str] = "`frame_id`; absent: a world-fixed frame such as `map`"
    shape_from: ClassVar[str] = "nav_msgs"
    ros_type: ClassVar[str] = "nav_msgs/msg/Path"
    poses: list[Pose] = Field(max_length=MAX_POSES)
    frame_id: str | None = frame()
    timestamp: int | None = stamp()


class OccupancyGrid(StandardMessage):
    """A map of square cells: which are free, which are not."""

    schema_id: ClassVar[str] = "mosaic/OccupancyGrid@1"
    given_in: ClassVar[str] = "`frame_id`; absent: `map`"
    shape_from: ClassVar[str] = "nav_msgs, its `info` and its data side by side"
    ros_type: ClassVar[str] = "nav_msgs/msg/OccupancyGrid"
    resolution: float = Field(gt=0, json_schema_extra=unit("m"), description="The side of a cell.")
    width: int = Field(ge=1, description="Cells along x.")
    height: int = Field(ge=1, description="Cells along y.")
    origin: Pose = Field(description="The corner of the first cell, and which way x and y go.")
    data: list[Annotated[int, Field(ge=-1, le=100)]] = Field(
        max_length=MAX_CELLS,
        description="Row after row along x; 0 is free, 100 occupied, -1 unknown.",
        json_schema_extra=unit("%"),
    )
    frame_id: str | None = frame()
    timestamp: int | None = stamp()

    @model_validator(mode="after")
    def _has_all_its_cells(self) -> Self:
        if len(self.data) != self.width * self.height:
            raise ValueError(
                f"data has {len(self.data)} cells for a width of {self.width} and a height of {self.height}"
            )
        return self


def _names(data: dict[Any, Any]) -> str:
    """The first keys, short enough for an error message that travels back to the sender."""
    return ", ".join(str(key)[:20] for key in list(data)[:4])
