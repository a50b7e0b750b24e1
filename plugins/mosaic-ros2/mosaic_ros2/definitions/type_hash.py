"""Computes the hash of a type as ROS does from Iron on (REP-2011, RIHS01): SHA-256 of its description as JSON. Pure."""

from __future__ import annotations

import hashlib
import json
from typing import Any

from mosaic_ros2.definitions.definition import Definition, Field, FieldType, full_name
from mosaic_ros2.definitions.type_book import TypeBook

_IDS = {
    "int8": 2, "uint8": 3, "int16": 4, "uint16": 5, "int32": 6, "uint32": 7, "int64": 8, "uint64": 9, "float32": 10,
    "float64": 11, "char": 3, "bool": 15, "byte": 16, "string": 17, "wstring": 18,
}  # fmt: skip
"""type_description_interfaces/FieldType; a ``char`` of a ``.msg`` file is a ``uint8``."""
_NESTED = 1
_BOUNDED = {17: 21, 18: 22}
_ARRAY, _BOUNDED_SEQUENCE, _SEQUENCE = 48, 96, 144
_MESSAGE_OF_SERVICE = ("_Request", "_Response")
_EVENT_INFO = "service_msgs/msg/ServiceEventInfo"


def type_hash(book: TypeBook, name: str) -> str:
    """``RIHS01_…`` of a message. Raises :class:`~mosaic_ros2.definitions.definition.DefinitionError`."""
    return _digest(full_name(name), book.closure(name))


def service_hash(book: TypeBook, name: str) -> str:
    """``RIHS01_…`` of a service, which consists of its request, its response and its event (REP-2012)."""
    name = full_name(name)
    request, response = (f"{name}{part}" for part in _MESSAGE_OF_SERVICE)
    event = f"{name}_Event"
    event_fields = (
        Field("info", FieldType(_EVENT_INFO)),
        Field("request", FieldType(request, "sequence", 1)),
        Field("response", FieldType(response, "sequence", 1)),
    )
    parts = ("request_message", request), ("response_message", response), ("event_message", event)
    own = Definition(name, tuple(Field(field, FieldType(kind)) for field, kind in parts))
    closure = {**book.closure(request), **book.closure(response), **book.closure(_EVENT_INFO)}
    return _digest(name, {**closure, event: Definition(event, event_fields), name: own})


def _digest(name: str, definitions: dict[str, Definition]) -> str:
    others = [_described(definitions[one]) for one in sorted(definitions) if one != name]
    description = {"type_description": _described(definitions[name]), "referenced_type_descriptions": others}
    return f"RIHS01_{hashlib.sha256(json.dumps(description).encode()).hexdigest()}"


def _described(definition: Definition) -> dict[str, Any]:
    fields = [{"name": one.name, "type": _field_type(one.type)} for one in definition.fields]
    return {"type_name": definition.name, "fields": fields}


def _field_type(kind: FieldType) -> dict[str, Any]:
    number = _IDS.get(kind.base, _NESTED)
    if kind.text_bound:
        number = _BOUNDED[number]
    if kind.shape == "array":
        number += _ARRAY
    elif kind.shape == "sequence":
        number += _BOUNDED_SEQUENCE if kind.size else _SEQUENCE
    return {
        "type_id": number,
        "capacity": kind.size,
        "string_capacity": kind.text_bound,
        "nested_type_name": kind.base if kind.is_message else "",
    }
