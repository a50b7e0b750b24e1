"""The base classes of everything that is spoken, and of the YAML file: emit exactly, read tolerantly, forgive no typo.

A :class:`WireModel` is a signaling or control message (camelCase on the wire); unknown keys are ignored on
receipt. What we emit is validated, finite JSON: a NaN is refused here and never reaches a peer.
"""

from __future__ import annotations

import json
from typing import Annotated, Any, TypeAlias

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator
from pydantic.alias_generators import to_camel

from mosaic_core.words.plain_text import plain

PlainText: TypeAlias = Annotated[str, AfterValidator(plain), Field(json_schema_extra={"format": "plain"})]
"""A field of a message that people read. Pages read it alike, by the format in the schema."""

MAX_DEPTH = 32
"""Nesting beyond this is no measurement, and would make the encoder's recursion a way to stop a connector."""


class WireModel(BaseModel):
    """A message of our own protocol: snake_case here, camelCase on the wire, unknown keys ignored."""

    model_config = ConfigDict(
        alias_generator=to_camel,
        populate_by_name=True,
        extra="ignore",
        frozen=True,
        allow_inf_nan=False,
    )

    def wire(self) -> dict[str, Any]:
        """The message as JSON-ready values; fields that are ``None`` and optional are left out."""
        return self.model_dump(mode="json", by_alias=True, exclude_none=True)


class ConfigModel(BaseModel):
    """Unknown keys are errors; a key without a value (``params:``) counts as absent, as in original robots."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _nothing_is_absent(cls, data: object) -> object:
        return {key: value for key, value in data.items() if value is not None} if isinstance(data, dict) else data


def to_json(value: Any) -> str:
    """Compact JSON text; raises :class:`ValueError` for NaN and infinities, which JSON does not know."""
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def parsed_object(data: bytes) -> dict[str, Any]:
    """The JSON object in ``data``, as :func:`parsed_value` reads it."""
    value = parsed_value(data)
    if not isinstance(value, dict):
        raise ValueError(f"a JSON {type(value).__name__} where an object is expected")
    return value


def parsed_value(data: bytes) -> Any:
    """The JSON value in ``data``: finite numbers, valid Unicode, bounded depth. Raises :class:`ValueError` that says
    what is wrong with it."""
    try:
        value = json.loads(data)
    except RecursionError:
        raise ValueError(f"nested deeper than {MAX_DEPTH}") from None
    if _is_deeper_than(MAX_DEPTH, value):
        raise ValueError(f"nested deeper than {MAX_DEPTH}")
    to_json(value).encode()
    return value


def _is_deeper_than(depth: int, value: Any) -> bool:
    layer = [value]
    for _ in range(depth):
        layer = [inner for outer in layer for inner in _children(outer)]
    return bool(layer)


def _children(value: Any) -> list[Any]:
    if isinstance(value, dict):
        return list(value.values())
    return value if isinstance(value, list) else []


def wrong_fields(error: ValidationError) -> str:
    """The fields that a model found wrong or missing; ``data`` where it is the whole."""
    return ", ".join(".".join(map(str, problem["loc"])) or "data" for problem in error.errors())


def told_mistakes(error: ValidationError, most: int = 3) -> str:
    """The first things that a model found wrong, each behind its field, without what was said there."""
    found = [(".".join(map(str, one["loc"])), one["msg"]) for one in error.errors()[:most]]
    return "; ".join(f"{field}: {wrong}" if field else wrong for field, wrong in found)
