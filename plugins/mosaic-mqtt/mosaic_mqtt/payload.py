"""Reads and writes the payloads of MQTT messages. Whatever is read can be sent: finite numbers, valid Unicode,
bounded depth.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Literal

from mosaic_core.words.wire_model import to_json

MAX_DEPTH = 32
"""Nesting beyond this is no measurement, and would make the encoder's recursion a way to stop the connector."""


def json_value(payload: bytes) -> Any:
    """The JSON value in ``payload``. Raises :class:`ValueError` that says what is wrong with it."""
    try:
        value = json.loads(payload)
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


def payload_of(command: Mapping[str, Any], form: Literal["json", "value"]) -> bytes:
    """The command as a JSON object; ``value``: its only value, where text has no quotation marks."""
    if form == "json":
        return to_json(dict(command)).encode()
    (value,) = command.values()
    return value.encode() if isinstance(value, str) else to_json(value).encode()
