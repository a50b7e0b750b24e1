"""Finds the numbers of a message that JSON does not know (NaN, infinities), and makes null of what may be absent."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeAlias

Alternatives: TypeAlias = "list[Mapping[str, Any]]"
_MAX_DEPTH = 32
"""What is nested more deeply is left as it is; JSON refuses it."""


def finite(value: Any, schema: Mapping[str, Any] | None) -> tuple[Any, tuple[str, ...]]:
    """``value`` with null for each number that is not finite, and the paths of those that ``schema`` gives no null
    (``ranges[]``, ``pose.x``). ``schema``: the JSON Schema of the message; ``None``: nobody has declared it."""
    refused: dict[str, None] = {}
    definitions = {} if schema is None else schema.get("$defs", {})
    found = _Walk(definitions, refused).nulled(value, () if schema is None else (schema,), "", 0)
    return found, tuple(refused)


class _Walk:
    def __init__(self, definitions: Mapping[str, Any], refused: dict[str, None]) -> None:
        self._definitions = definitions
        self._refused = refused

    def nulled(self, value: Any, schemas: Sequence[Mapping[str, Any]], path: str, depth: int) -> Any:
        """``schemas``: the alternatives that are declared for it."""
        if isinstance(value, float):
            if math.isfinite(value):
                return value
            if not any(_takes_null(one) for schema in schemas for one in self._alternatives(schema)):
                self._refused[path or "message"] = None
            return None
        if depth >= _MAX_DEPTH:
            return value
        if isinstance(value, Mapping):
            return {
                key: self.nulled(
                    one, [*self._of_key(schemas, str(key))], f"{path}.{key}" if path else str(key), depth + 1
                )
                for key, one in value.items()
            }
        if isinstance(value, list | tuple):
            places, rest = self._of_items(schemas)
            inner = (places[index] if index < len(places) else rest for index in range(len(value)))
            return [self.nulled(one, its, f"{path}[]", depth + 1) for one, its in zip(value, inner, strict=True)]
        return value

    def _alternatives(self, schema: Mapping[str, Any], depth: int = 0) -> Iterator[Mapping[str, Any]]:
        """Itself and what it refers to."""
        yield schema
        if depth >= _MAX_DEPTH:
            return
        if "$ref" in schema:
            name = str(schema["$ref"]).rsplit("/", 1)[-1]
            yield from self._alternatives(self._definitions.get(name, _NOTHING), depth + 1)
        for word in ("anyOf", "oneOf", "allOf"):
            for one in schema.get(word, ()):
                yield from self._alternatives(one, depth + 1)

    def _of_key(self, schemas: Sequence[Mapping[str, Any]], key: str) -> Iterator[Mapping[str, Any]]:
        for schema in schemas:
            for one in self._alternatives(schema):
                inner = one.get("properties", {}).get(key, one.get("additionalProperties"))
                if isinstance(inner, Mapping):
                    yield inner

    def _of_items(self, schemas: Sequence[Mapping[str, Any]]) -> tuple[list[Alternatives], Alternatives]:
        """Of each place of a tuple that has one of its own, and of every other item."""
        places: list[Alternatives] = []
        rest: Alternatives = []
        for one in (its for schema in schemas for its in self._alternatives(schema)):
            own = one.get("prefixItems", ())
            places += ([] for _ in own[len(places) :])
            for at_place, item in zip(places, own, strict=False):
                at_place.append(item)
            if isinstance(one.get("items"), Mapping):
                rest.append(one["items"])
        return places, rest


_NOTHING: Mapping[str, Any] = {"type": "nothing"}


def _takes_null(schema: Mapping[str, Any]) -> bool:
    kind = schema.get("type")
    is_anything = not schema.keys() - {"title", "description", "default", "unit"}
    return is_anything or kind == "null" or (isinstance(kind, list) and "null" in kind)
