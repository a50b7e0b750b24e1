"""Keeps the JSON Schemas of messages, and finds what one says of one field."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Literal
from weakref import WeakKeyDictionary

from pydantic import BaseModel

from mosaic_core.contract.declared.nested_models import is_model
from mosaic_core.contract.units import unit_of

_MAX_DEPTH = 32
Mode = Literal["validation", "serialization"]
_made: WeakKeyDictionary[type[BaseModel], dict[Mode, dict[str, Any]]] = WeakKeyDictionary()


def schema_of(model: type[BaseModel], mode: Mode = "validation") -> dict[str, Any]:
    """The schema of a class, which does not change and is made once: each look at a receiver's limits asks for it, and
    pydantic takes milliseconds. Whoever gets it changes nothing in it. Any thread."""
    its = _made.setdefault(model, {})
    if mode not in its:
        its[mode] = model.model_json_schema(mode=mode)
    return its[mode]


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


def unit_at(message_type: Any, field: str) -> str:
    """The unit of a number of these messages, by its dotted path, or of the list that it stands in; empty where nobody
    says it."""
    if not is_model(message_type):
        return ""
    path, nodes = field.split("."), nodes_on(schema_of(message_type), tuple(field.split(".")))
    said = [unit_of(name, node) for name, node in zip(path, nodes, strict=True)]
    return next((unit for unit in reversed(said) if unit), "")


def nodes_on(schema: Mapping[str, Any], path: tuple[str, ...]) -> Iterator[Mapping[str, Any]]:
    """What stands in the schema at each step of ``path``; empty where it names none."""
    node = schema
    for key in path:
        node = object_of(schema, node).get("properties", {}).get(key, {})
        yield node
