"""Describes a connector's params for people, from its models alone."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, TypeAlias

from pydantic import TypeAdapter

from mosaic_core.contract.configurer import Configurer, MediaTrackConfigurer
from mosaic_core.contract.handler import message_type_of
from mosaic_core.contract.request_handler import answer_schema
from mosaic_core.contract.units import unit_of
from mosaic_core.runtime.configuration.request_problems import CURES, declared_requests
from mosaic_core.words.config import SafetyConfig
from mosaic_core.words.delivery import DeliveryContract

Row: TypeAlias = tuple[str, str, str, str, str]
"""``(name, type, default, unit, description)`` of one field."""
_OWN = "its own"
_OF_THE_CLASS = frozenset({"timeout_s", "requires_lease", "resource", "limits", "slow_down"})
"""Keys of `safety` that a handler's class answers where the file says nothing."""
_MAX_DEPTH = 6
"""Of messages in messages; one may contain itself."""


def param_tables(configurer: type[Configurer[Any]], *, receives: bool = True) -> Iterator[tuple[str, list[Row]]]:
    """Each table's heading and rows: the params, every mapping that a param may be, limits where it ``receives``
    anything, and delivery."""
    schema = configurer.params_model.model_json_schema()
    definitions = schema.get("$defs", {})
    if schema.get("properties"):
        yield "params", _rows(schema, definitions)
    for name, field in schema.get("properties", {}).items():
        for inner in _mappings_in(field, definitions):
            title = inner.get("title", "")
            yield f"params.{name}" + (f" ({title})" if title else ""), _rows(inner, definitions)
    for heading, inner in request_schemas(configurer).items():
        yield heading, _rows(inner, inner.get("$defs", {}))
    if receives and not issubclass(configurer, MediaTrackConfigurer):
        useless = CURES if declared_requests(configurer) is not None else ()
        yield "safety", [row for row in _safety_rows(configurer.safety_model) if row[0] not in useless]
    if not issubclass(configurer, MediaTrackConfigurer):
        yield "delivery", list(_delivery_rows())


def request_schemas(configurer: type[Configurer[Any]]) -> dict[str, dict[str, Any]]:
    """The JSON Schemas of ``question`` and ``answer``, where ``configure`` is declared to make a request handler."""
    made = declared_requests(configurer)
    if made is None:
        return {}
    question = TypeAdapter(message_type_of(made)).json_schema()
    return {"question": question, "answer": answer_schema(made)}


def message_rows(schema: dict[str, Any]) -> list[Row]:
    """Every field of a message, those of the messages in it by their path: ``linear.x``, ``boxes[].label``."""
    by_name = {row[0]: row for row in _nested_rows(schema, schema.get("$defs", {}), "", 0)}
    return list(by_name.values())


def _nested_rows(schema: dict[str, Any], definitions: dict[str, Any], prefix: str, depth: int) -> Iterator[Row]:
    for row, field in zip(_rows(schema, definitions), schema.get("properties", {}).values(), strict=True):
        name = f"{prefix}{row[0]}"
        yield (name, *row[1:])
        is_list = any("items" in part for part in (field, *field.get("anyOf", ())))
        for inner in _mappings_in(field, definitions) if depth < _MAX_DEPTH else ():
            yield from _nested_rows(inner, definitions, f"{name}{'[]' if is_list else ''}.", depth + 1)


def _safety_rows(model: type[SafetyConfig]) -> Iterator[Row]:
    """What the class of a handler may say is its own, unless the connector's model of limits says it for all."""
    schema = model.model_json_schema()
    for name, kind, default, unit, description in _rows(schema, schema.get("$defs", {})):
        is_own = name in _OF_THE_CLASS and model.model_fields[name].default == SafetyConfig.model_fields[name].default
        yield name, kind, _OWN if is_own else default, unit, description


def _delivery_rows() -> Iterator[Row]:
    """The long form; what the connector chooses is known once it is made."""
    schema = DeliveryContract.model_json_schema()
    for long_form in _mappings_in(schema, {}):
        for name, kind, _, unit, description in _rows(long_form, schema.get("$defs", {})):
            yield name, kind, _OWN, unit, description


def _mappings_in(field: dict[str, Any], definitions: dict[str, Any]) -> Iterator[dict[str, Any]]:
    if "$ref" in field:
        field = definitions.get(str(field["$ref"]).rsplit("/", 1)[-1], {})
    if "properties" in field:
        yield field
    for choice in ("anyOf", "oneOf", "allOf"):
        for part in field.get(choice, ()):
            yield from _mappings_in(part, definitions)
    if isinstance(field.get("items"), dict):
        yield from _mappings_in(field["items"], definitions)


def _rows(schema: dict[str, Any], definitions: dict[str, Any]) -> list[Row]:
    required = set(schema.get("required", ()))
    return [
        (
            name,
            type_in_words(field, definitions),
            "required" if name in required else _default(field),
            unit_of(name, field),
            field.get("description", ""),
        )
        for name, field in schema.get("properties", {}).items()
    ]


def _default(field: dict[str, Any]) -> str:
    default = field.get("default")
    if default is None:
        return "none"
    return str(default).lower() if isinstance(default, bool) else str(default)


def type_in_words(field: dict[str, Any], definitions: dict[str, Any]) -> str:
    """``integer ≥ 1``, ``'a' | 'b'``, ``list of text``."""
    if "$ref" in field:
        name = str(field["$ref"]).rsplit("/", 1)[-1]
        inner = definitions.get(name, {})
        return type_in_words(inner, definitions) if "enum" in inner else name
    for choice in ("anyOf", "oneOf", "allOf"):
        if choice in field:
            parts = [type_in_words(part, definitions) for part in field[choice] if part.get("type") != "null"]
            return " | ".join(dict.fromkeys(parts))
    if "enum" in field or "const" in field:
        return " | ".join(map(repr, field.get("enum", [field.get("const")])))
    if field.get("type") == "array":
        return f"list of {type_in_words(field.get('items', {}), definitions)}"
    words = {"string": "text", "object": "mapping"}.get(str(field.get("type")), str(field.get("type", "anything")))
    if words == "mapping" and "title" in field and "properties" in field:
        words = str(field["title"])
    return words + _bounds(field)


def _bounds(field: dict[str, Any]) -> str:
    signs = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}
    found = [f"{sign} {_short(field[key])}" for key, sign in signs.items() if key in field]
    return f" {', '.join(found)}" if found else ""


def _short(number: float) -> str:
    return f"{number:.0f}" if number == int(number) else f"{number:g}"
