"""What a robot tells of itself in words, and what it marks in its pictures."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from mosaic_core.contract.params import unit
from mosaic_core.messages.standard import Name, Sentence, StandardMessage, absent, stamp

MAX_MARKS = 1000

Pixels = Annotated[float, Field(json_schema_extra=unit("px"))]


class Log(StandardMessage):
    """A line of a program's log."""

    schema_id: ClassVar[str] = "mosaic/Log@1"
    given_in: ClassVar[str] = "–"
    shape_from: ClassVar[str] = "rcl_interfaces, levels as words"
    ros_type: ClassVar[str] = "rcl_interfaces/msg/Log"
    level: Literal["debug", "info", "warn", "error", "fatal"] = "info"
    message: Sentence
    name: Name | None = absent(description="Of what speaks.")
    timestamp: int | None = stamp()


class Diagnostic(StandardMessage):
    """How a part of the robot is."""

    schema_id: ClassVar[str] = "mosaic/Diagnostic@1"
    given_in: ClassVar[str] = "–"
    shape_from: ClassVar[str] = "diagnostic_msgs, levels as words; REP-107"
    ros_type: ClassVar[str] = "diagnostic_msgs/msg/DiagnosticStatus"
    level: Literal["ok", "warn", "error", "stale"] = Field(description="stale: it has not been heard for too long.")
    name: Name = Field(description="Of the part.")
    message: Sentence = ""
    hardware_id: Name | None = absent()
    values: dict[Name, Sentence] = Field(default={}, max_length=64, description="What was looked at, as text.")
    timestamp: int | None = stamp()


class _Mark(StandardMessage):
    color: str | None = absent(pattern=r"^#[0-9a-fA-F]{6}$", description="`#rrggbb`.")


class ImageBox(_Mark):
    """A rectangle around something that was found."""

    x: Pixels = Field(description="Of its left side.")
    y: Pixels = Field(description="Of its upper side.")
    width: Pixels = Field(ge=0)
    height: Pixels = Field(ge=0)
    label: Name | None = absent()
    score: float | None = absent(ge=0, le=1, description="How sure it is.")


class ImagePoint(StandardMessage):
    """A place in a picture."""

    x: Pixels
    y: Pixels


class ImageLine(_Mark):
    """A line from point to point."""

    points: list[ImagePoint] = Field(min_length=1, max_length=MAX_MARKS)
    closed: bool = Field(default=False, description="The last point is joined to the first.")


class ImageText(_Mark):
    """Words at a place of a picture."""

    x: Pixels = Field(description="Of their left end.")
    y: Pixels = Field(description="Of their base line.")
    text: Name


class ImageAnnotations(StandardMessage):
    """What is marked in a camera's picture. The dashboard draws it over that picture: the one of ``captured_at_us``."""

    schema_id: ClassVar[str] = "mosaic/ImageAnnotations@1"
    given_in: ClassVar[str] = "pixels of the camera's picture: x right, y down, from its upper left corner"
    shape_from: ClassVar[str] = "foxglove, boxes as in vision_msgs"
    ros_type: ClassVar[str] = "foxglove_msgs/msg/ImageAnnotations"
    camera: Name | None = absent(description="Label of the camera.")
    width: int | None = absent("px", gt=0, description="Of the picture that was looked at.")
    height: int | None = absent("px", gt=0, description="Of the picture that was looked at.")
    captured_at_us: int | None = absent(
        "µs", ge=0, description="When that picture was captured, on the robot's monotonic clock, as a tap tells it."
    )
    boxes: list[ImageBox] = Field(default=[], max_length=MAX_MARKS)
    lines: list[ImageLine] = Field(default=[], max_length=MAX_MARKS)
    texts: list[ImageText] = Field(default=[], max_length=MAX_MARKS)
    timestamp: int | None = stamp()
