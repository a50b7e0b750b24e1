"""Gives any ROS message a JSON form with a schema: a pydantic model from its definition, and plain values."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, create_model

from mosaic_core.contract.params import Message
from mosaic_ros2.definitions.definition import EMPTY_MEMBER, NUMBERS, FieldType
from mosaic_ros2.definitions.type_book import TypeBook

_WHOLE = {"byte": (0, 8), "char": (0, 8)} | {
    f"{sign}int{bits}": (0 if sign else 1, bits) for sign in ("", "u") for bits in (8, 16, 32, 64)
}
"""Whole numbers: whether they are signed, and their bits."""
_TAKEN = frozenset(dir(Message)) | frozenset(("self",))
"""Names that a model has already: such a field keeps its name in JSON alone."""


class _RosModel(Message):
    model_config = ConfigDict(extra="forbid", protected_namespaces=(), populate_by_name=False)


def model_of(book: TypeBook, name: str, *, is_command: bool) -> type[Message]:
    """The model of this message's JSON. ``is_command``: for what operators send: keys that it does not have are
    mistakes, those left out are zero, and numbers are finite; else numbers may be ``null``, where ROS has NaN or an
    infinity. Raises :class:`~mosaic_ros2.definitions.definition.DefinitionError`."""
    made: dict[str, type[Message]] = {}
    for one in book.closure(name).values():
        fields: dict[str, Any] = {}
        for field in one.fields:
            if field.name == EMPTY_MEMBER:
                continue
            annotation, default = _annotation(field.type, made, is_command)
            own = f"{field.name.strip('_')}_" if field.name in _TAKEN or field.name.startswith("_") else field.name
            alias = field.name if own != field.name else None
            fields[own] = (annotation, Field(default=default, alias=alias) if is_command else Field(alias=alias))
        title = one.name.replace("/msg/", "/")
        made[one.name] = create_model(
            one.name.rsplit("/", 1)[-1], __base__=_RosModel if is_command else Message, __doc__=title, **fields
        )
    return made[book.find(name).name]


def _annotation(kind: FieldType, made: Mapping[str, type[Message]], is_command: bool) -> tuple[Any, Any]:
    one: Any
    one, zero = _single(kind, made, is_command)
    if kind.shape == "one":
        return one, zero
    if kind.shape == "array":
        return Annotated[list[one], Field(min_length=kind.size, max_length=kind.size)], [zero] * kind.size
    return Annotated[list[one], Field(max_length=kind.size or None)], []


def _single(kind: FieldType, made: Mapping[str, type[Message]], is_command: bool) -> tuple[Any, Any]:
    if kind.is_text:
        return (Annotated[str, Field(max_length=kind.text_bound)] if kind.text_bound else str), ""
    if kind.base == "bool":
        return bool, False
    if kind.base in _WHOLE:
        signed, bits = _WHOLE[kind.base]
        least, most = -(1 << bits - 1) * signed, (1 << bits - signed) - 1
        return Annotated[int, Field(ge=least, le=most)], 0
    if kind.base in NUMBERS:
        return (Annotated[float, Field(strict=True)], 0.0) if is_command else (float | None, 0.0)
    return made[kind.base], made[kind.base]() if is_command else None


def plain(message: Mapping[str, Any]) -> dict[str, Any]:
    """A decoded message as JSON has it: arrays as lists, numbers that are not finite as ``None``."""
    return {name: _plain_value(value) for name, value in message.items() if name != EMPTY_MEMBER}


def _plain_value(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, np.ndarray):
        items = value.tolist()
        if value.dtype.kind == "f" and not np.isfinite(value).all():
            return [one if math.isfinite(one) else None for one in items]
        return items
    if isinstance(value, Mapping):
        return plain(value)
    return [_plain_value(one) for one in value] if isinstance(value, list) else value


def fields_of(message: BaseModel) -> dict[str, Any]:
    """What an operator sent, by the names that ROS has."""
    return message.model_dump(by_alias=True)
