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


def wrong_fields(error: ValidationError) -> str:
    """The fields that a model found wrong or missing; ``data`` where it is the whole."""
    return ", ".join(".".join(map(str, problem["loc"])) or "data" for problem in error.errors())
