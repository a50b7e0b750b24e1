"""Models the params of connectors on serial lines, and makes the messages that their fields describe."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, StringConstraints, field_validator

from mosaic_core.contract.made_message import MadeField, made_message
from mosaic_core.contract.params import Message, Params
from mosaic_core.words.limits import MotionKind
from mosaic_sensors.byte_source import live_source

MAX_TEXT = 256
"""Characters of a text in a command."""
_TYPES: dict[str, Any] = {
    "number": float, "integer": int, "boolean": bool, "text": Annotated[str, StringConstraints(max_length=MAX_TEXT)],
}  # fmt: skip


class LineParams(Params):
    """What all devices on a serial line have in common."""

    source: str = Field(
        default="/dev/ttyUSB0",
        description="/dev/tty… or COM3: a serial port; tcp://host:port: one that another computer passes on; "
        "`fake`: a device that is made up, to try it.",
    )
    baud: int = Field(default=115_200, gt=0, description="Speed of the serial port.")
    silence_s: float | None = Field(
        default=None, gt=0, description="Open it again when no line came for so long; default: it may be silent."
    )
    max_line_bytes: int = Field(default=4096, ge=16, le=65_536, description="Longer lines are refused.")
    max_rate_hz: float = Field(default=100.0, gt=0, le=1000, description="What comes faster is left out, and counted.")

    @field_validator("source")
    @classmethod
    def _can_be_opened(cls, source: str) -> str:
        return live_source(source)


class LineField(Params):
    """One key of a JSON line."""

    type: Literal["number", "integer", "boolean", "text"] = Field(default="number", description="What it is.")
    unit: str | None = Field(default=None, max_length=16, description="As operators see it; default: by its name.")
    description: str = Field(default="", max_length=200, description="What it means.")


class CommandField(LineField):
    """One key of a command."""

    kind: MotionKind | None = Field(
        default=None, description="velocity: it moves something and 0 stands still; position: it is a place to go to."
    )


def message_of(name: str, fields: Mapping[str, LineField]) -> type[Message]:
    """The message with these keys, all of them required."""
    return made_message(name, {key: _made(field) for key, field in fields.items()})


def _made(field: LineField) -> MadeField:
    kind = field.kind if isinstance(field, CommandField) else None
    return MadeField(_TYPES[field.type], field.unit, field.description, kind)
