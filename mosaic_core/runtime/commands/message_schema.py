"""Finds what a JSON Schema says of one field of a message."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

_MAX_DEPTH = 32


def object_of(schema: Mapping[str, Any], node: Mapping[str, Any]) -> Mapping[str, Any]:
    """``node``, or what it refers to, or the first alternative that has properties."""
    return next((one for one in alternatives_of(schema, node) if "properties" in one), node)


def alternatives_of(schema: Mapping[str, Any], node: Mapping[str, Any], depth: int = 0) -> Iterator[Mapping[str, Any]]:
    """``node``, what it refers to and what it may be instead."""
    if depth > _MAX_DEPTH:
        return
    yield node
    if "$ref" in node:
        yield from alternatives_of(
            schema, schema.get("$defs", {}).get(str(node["$ref"]).rsplit("/", 1)[-1], {}), depth + 1
        )
    for name in ("allOf", "anyOf", "oneOf"):
        for one in node.get(name, ()):
            yield from alternatives_of(schema, one, depth + 1)


def nodes_on(schema: Mapping[str, Any], path: tuple[str, ...]) -> Iterator[Mapping[str, Any]]:
    """What stands in the schema at each step of ``path``; empty where it names none."""
    node = schema
    for key in path:
        node = object_of(schema, node).get("properties", {}).get(key, {})
        yield node
