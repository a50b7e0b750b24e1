"""Finds the numbers of a message by their dotted paths, as limits and motion fields name them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, get_args

from pydantic import AliasChoices, AliasPath, BaseModel

_MAX_DEPTH = 5
"""A model may contain itself."""


def has_two_names(model: Any, path: list[str]) -> bool:
    """Whether a message may say a field on this path by another name than the one that is limited."""
    if not path or not (isinstance(model, type) and issubclass(model, BaseModel)):
        return False
    takes_both = model.model_config.get("populate_by_name") or model.model_config.get("validate_by_name")
    for name, info in model.model_fields.items():
        alias = info.validation_alias or info.alias
        names = [name] if alias is None else alias.choices if isinstance(alias, AliasChoices) else [alias]
        if path[0] in names or path[0] == name:
            if len(names) > 1 or isinstance(names[0], AliasPath) or (takes_both and names != [name]):
                return True
            return any(has_two_names(inner, path[1:]) for inner in (info.annotation, *get_args(info.annotation)))
    return False


def field_paths(schema: dict[str, Any] | None) -> frozenset[str]:
    """The dotted paths of all numbers that a JSON Schema names; none where it names no properties."""
    return frozenset(_numbers(schema, schema.get("$defs", {}), 0)) if schema is not None else frozenset()


def _numbers(schema: dict[str, Any], definitions: dict[str, Any], depth: int) -> Iterator[str]:
    for name, field in schema.get("properties", {}).items():
        for choice in (field, *(one for kind in ("anyOf", "allOf", "oneOf") for one in field.get(kind, ()))):
            inner = definitions.get(str(choice.get("$ref", "")).rsplit("/", 1)[-1], choice)
            if inner.get("type") in ("number", "integer"):
                yield name
            elif depth < _MAX_DEPTH:
                yield from (f"{name}.{path}" for path in _numbers(inner, definitions, depth + 1))
