"""Writes the payloads of MQTT messages."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

from mosaic_core.words.wire_model import to_json


def payload_of(command: Mapping[str, Any], form: Literal["json", "value"]) -> bytes:
    """The command as a JSON object; ``value``: its only value, where text has no quotation marks."""
    if form == "json":
        return to_json(dict(command)).encode()
    (value,) = command.values()
    return value.encode() if isinstance(value, str) else to_json(value).encode()
