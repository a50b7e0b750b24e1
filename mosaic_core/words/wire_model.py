"""The two base classes of everything that is spoken: emit exactly, read tolerantly.

A :class:`WireModel` is a signaling or control message (camelCase on the wire); unknown keys are ignored on
receipt. What we emit is validated, finite JSON: a NaN is refused here and never reaches a peer.
"""

from __future__ import annotations

import json
from typing import Any

from pydantic import BaseModel, ConfigDict
from pydantic.alias_generators import to_camel


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


def to_json(value: Any) -> str:
    """Compact JSON text; raises :class:`ValueError` for NaN and infinities, which JSON does not know."""
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
