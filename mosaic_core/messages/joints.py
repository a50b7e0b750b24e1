"""Joints and grippers: how they stand, and where they shall go."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar, Self

from pydantic import Field, model_validator

from mosaic_core.contract.params import unit
from mosaic_core.messages.standard import Name, StandardMessage, absent, check_lengths, stamp
from mosaic_core.words.limits import MotionKind

MAX_JOINTS = 256

Exactly = Annotated[float, Field(strict=True)]


class _Joints(StandardMessage):
    names: list[Name] = Field(max_length=MAX_JOINTS, description="Of the joints, each once.")

    @model_validator(mode="after")
    def _names_are_unique(self) -> Self:
        twice = sorted({name for name in self.names if self.names.count(name) > 1})
        if twice:
            raise ValueError(f"names has {twice[0]!r} twice")
        return self


class JointState(_Joints):
    """How joints stand. A list that is empty is not known; the others have a value for each name."""

    schema_id: ClassVar[str] = "mosaic/JointState@1"
    given_in: ClassVar[str] = "each joint's own axis"
    shape_from: ClassVar[str] = "sensor_msgs, its names in the plural"
    ros_type: ClassVar[str] = "sensor_msgs/msg/JointState"
    positions: list[float] = Field(default=[], description="Prismatic joints: m.", json_schema_extra=unit("rad"))
    velocities: list[float] = Field(default=[], description="Prismatic joints: m/s.", json_schema_extra=unit("rad/s"))
    efforts: list[float] = Field(default=[], description="Prismatic joints: N.", json_schema_extra=unit("Nm"))
    timestamp: int | None = stamp()

    @model_validator(mode="after")
    def _lengths_match(self) -> Self:
        lists = {"positions": self.positions, "velocities": self.velocities, "efforts": self.efforts}
        check_lengths("names", len(self.names), **lists)
        return self


class JointTarget(_Joints):
    """Where joints shall go. Joints that are not named stay where they are."""

    schema_id: ClassVar[str] = "mosaic/JointTarget@1"
    given_in: ClassVar[str] = "each joint's own axis"
    shape_from: ClassVar[str] = "one point of trajectory_msgs"
    ros_type: ClassVar[str] = "trajectory_msgs/msg/JointTrajectory"
    motion_kinds: ClassVar[Mapping[str, MotionKind]] = {"positions": "position"}
    keyed_by: ClassVar[Mapping[str, str]] = {"positions": "names"}
    positions: list[Exactly] = Field(
        description="One for each name; prismatic joints: m.", json_schema_extra=unit("rad")
    )
    duration_s: float | None = absent("s", gt=0, description="Be there in so much time; absent: as fast as is allowed.")

    @model_validator(mode="after")
    def _lengths_match(self) -> Self:
        if len(self.positions) != len(self.names):
            raise ValueError(f"positions has {len(self.positions)} values for {len(self.names)} names")
        return self


class GripperTarget(StandardMessage):
    """How far a gripper shall open, and how hard it may press."""

    schema_id: ClassVar[str] = "mosaic/GripperTarget@1"
    given_in: ClassVar[str] = "the gripper's own axis"
    shape_from: ClassVar[str] = "control_msgs"
    ros_type: ClassVar[str] = "control_msgs/msg/GripperCommand"
    motion_kinds: ClassVar[Mapping[str, MotionKind]] = {"position": "position"}
    position: Exactly = Field(ge=0, description="Between the fingers; 0 is closed.", json_schema_extra=unit("m"))
    max_effort: float | None = absent("N", ge=0, description="Absent: as hard as the gripper presses by itself.")
