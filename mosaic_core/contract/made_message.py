"""Makes messages of fields that a robot's file describes, and handlers that take or send them."""

from __future__ import annotations

import types
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from pydantic import Field, create_model
from pydantic.config import JsonDict

from mosaic_core.contract.handler import Handler
from mosaic_core.contract.params import Message
from mosaic_core.words.limits import MotionKind

H = TypeVar("H", bound=Handler)
MAX_NAME = 64


@dataclass(frozen=True, slots=True)
class MadeField:
    """One field of a message. ``type``: as in an annotation; with ``None`` in it the field may be absent."""

    type: Any
    unit: str | None = None
    description: str = ""
    kind: MotionKind | None = None
    low: float | None = None
    high: float | None = None
    """Bounds beyond which a message is refused. What moves is limited instead (``DataChannelReceivable.limits``)."""
    default: Any = ...
    """``...``: a message without it is refused."""

    def definition(self) -> tuple[Any, Any]:
        """As pydantic wants it."""
        low, high = (self.low, self.high) if self.kind is None else (None, None)
        extra: JsonDict | None = None if self.unit is None else {"unit": self.unit}
        told = self.description or None
        return self.type, Field(self.default, description=told, json_schema_extra=extra, ge=low, le=high)


def check_names(names: Iterable[str]) -> None:
    """Raises :class:`ValueError` for a name that no field of a message can have."""
    for name in names:
        if not name.isidentifier() or name.startswith("_") or len(name) > MAX_NAME:
            raise ValueError(f"{name!r} is no name; write letters, digits and _, and begin with a letter")
        if hasattr(Message, name):
            raise ValueError(f"{name!r} has a meaning of its own here; choose another name")


def made_message(name: str, fields: Mapping[str, MadeField]) -> type[Message]:
    """The message with these fields, whose names :func:`check_names` has seen."""
    definitions: dict[str, Any] = {key: field.definition() for key, field in fields.items()}
    model: type[Message] = create_model(name, __base__=Message, __module__=__name__, **definitions)
    model.motion_kinds = {key: field.kind for key, field in fields.items() if field.kind}
    return model


def with_message(base: type[H], model: type[Message], way: Any) -> type[H]:
    """A subclass of ``base`` whose messages are of ``model``: the catalogue announces what the class says. ``way``:
    the generic handler that ``base`` derives from."""
    made: type[H] = types.new_class(
        base.__name__, (base, way[model]), exec_body=lambda body: body.update(__module__=base.__module__)
    )
    return made
