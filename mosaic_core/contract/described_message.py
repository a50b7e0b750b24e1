"""Makes messages whose fields a robot's YAML file describes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, StringConstraints

from mosaic_core.contract.made_message import MadeField, made_message
from mosaic_core.contract.params import Message, Params
from mosaic_core.words.limits import MotionKind

MAX_TEXT = 256
"""Characters of a text in a command."""
_TYPES: dict[str, Any] = {
    "number": float, "integer": int, "boolean": bool, "text": Annotated[str, StringConstraints(max_length=MAX_TEXT)],
}  # fmt: skip


class DescribedField(Params):
    """Describes one key of a message."""

    type: Literal["number", "integer", "boolean", "text"] = Field(default="number", description="What it is.")
    unit: str | None = Field(default=None, max_length=16, description="As operators see it; default: by its name.")
    description: str = Field(default="", max_length=200, description="What it means.")

    def made(self) -> MadeField:
        """The field of the message."""
        return MadeField(_TYPES[self.type], self.unit, self.description)


class CommandField(DescribedField):
    """Describes one key of a command."""

    kind: MotionKind | None = Field(
        default=None, description="velocity: it moves something and 0 stands still; position: it is a place to go to."
    )

    def made(self) -> MadeField:
        return MadeField(_TYPES[self.type], self.unit, self.description, self.kind)


def message_of(name: str, fields: Mapping[str, DescribedField]) -> type[Message]:
    """The message with these keys, all of them required."""
    return made_message(name, {key: field.made() for key, field in fields.items()})
