"""Makes messages whose fields a robot's YAML file describes, and handlers of them."""

from __future__ import annotations

import types
from collections.abc import Mapping
from typing import Annotated, Any, Literal, TypeVar

from pydantic import Field, StringConstraints, create_model

from mosaic_core.contract.handler import Handler
from mosaic_core.contract.params import Message, Params, unit
from mosaic_core.words.limits import MotionKind

H = TypeVar("H", bound=Handler)
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


class CommandField(DescribedField):
    """Describes one key of a command."""

    kind: MotionKind | None = Field(
        default=None, description="velocity: it moves something and 0 stands still; position: it is a place to go to."
    )


def checked_names(fields: Mapping[str, object]) -> None:
    """Raises :class:`ValueError` for a name that no message can have."""
    for name in fields:
        if not name.isidentifier() or name.startswith("_") or len(name) > 64:
            raise ValueError(f"{name!r} is no name; write letters, digits and _, and begin with a letter")
        if hasattr(Message, name):
            raise ValueError(f"{name!r} has a meaning of its own here; choose another name")


def message_of(name: str, fields: Mapping[str, DescribedField]) -> type[Message]:
    """The message with these keys, all of them required."""
    definitions: dict[str, Any] = {key: (_TYPES[field.type], _described(field)) for key, field in fields.items()}
    model: type[Message] = create_model(name, __base__=Message, __module__=__name__, **definitions)
    kinds = {key: field.kind for key, field in fields.items() if isinstance(field, CommandField) and field.kind}
    model.motion_kinds = kinds
    return model


def _described(field: DescribedField) -> Any:
    extra = None if field.unit is None else unit(field.unit)
    return Field(description=field.description or None, json_schema_extra=extra)


def with_message(base: type[H], model: type[Message], way: Any) -> type[H]:
    """A subclass of ``base`` whose messages are of ``model``: the catalogue announces what the class says. ``way``:
    the generic handler that ``base`` derives from."""
    made: type[H] = types.new_class(
        base.__name__, (base, way[model]), exec_body=lambda body: body.update(__module__=base.__module__)
    )
    return made
