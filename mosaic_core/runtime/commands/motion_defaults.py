"""Writes out what a receiver would take for motion fields that a message leaves out, if that moves.

Else a message without the field would move by a default that no limit has seen.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable, Mapping
from typing import Any


class MotionDefaults:
    """Completes the messages of one receiver. ``schema``: the JSON Schema of its messages; ``fields``: dotted paths of
    what moves.
    """

    def __init__(self, schema: Mapping[str, Any], fields: Iterable[str]) -> None:
        found: dict[tuple[str, ...], Any] = {}
        for field in fields:
            path, node = tuple(field.split(".")), schema
            for place, key in enumerate(path, 1):
                node = _object(schema, node).get("properties", {}).get(key, {})
                default = node.get("default")
                if _moves(default, path[place:]):
                    found[path[:place]] = default
        self._found = tuple(sorted(found.items(), key=lambda item: len(item[0])))

    def complete(self, message: dict[str, Any]) -> None:
        """Add to ``message`` what it leaves out and what isn't 0."""
        for path, default in self._found:
            inner: Any = message
            for key in path[:-1]:
                inner = inner.get(key) if isinstance(inner, dict) else None
            if isinstance(inner, dict) and path[-1] not in inner:
                inner[path[-1]] = copy.deepcopy(default)


def _moves(default: Any, path: Iterable[str]) -> bool:
    for key in path:
        default = default.get(key) if isinstance(default, dict) else None
    return isinstance(default, int | float) and not isinstance(default, bool) and default != 0


def _object(schema: Mapping[str, Any], node: Mapping[str, Any]) -> Mapping[str, Any]:
    """``node``, or what it refers to, or the first alternative that has properties."""
    if "$ref" in node:
        return _object(schema, schema.get("$defs", {}).get(str(node["$ref"]).rsplit("/", 1)[-1], {}))
    alternatives = (_object(schema, one) for name in ("allOf", "anyOf", "oneOf") for one in node.get(name, ()))
    return node if "properties" in node else next((one for one in alternatives if "properties" in one), node)
