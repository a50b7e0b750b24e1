"""Makes Cyclone DDS types from definitions, and definitions from types that peers tell (DDS-XTypes).

A type of ours has the name and the structure that ROS gives it, so that peers who compare structures match; its
samples are the bytes of a message, which are encoded and decoded elsewhere.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, get_args, get_origin, get_type_hints

from cyclonedds.idl import IdlStruct, make_idl_struct
from cyclonedds.idl import types as idl_types
from cyclonedds.idl.annotations import final

from mosaic_ros2.definitions.definition import (
    Definition,
    DefinitionError,
    Field,
    FieldShape,
    FieldType,
    dds_name,
    full_name,
)
from mosaic_ros2.definitions.type_book import TypeBook

types: Any = idl_types
"""Its holders are indexed, which no checker of types follows."""
_PRIMITIVES: dict[str, Any] = {
    "bool": bool, "byte": types.uint8, "char": types.uint8, "int8": types.int8, "uint8": types.uint8,
    "int16": types.int16, "uint16": types.uint16, "int32": types.int32, "uint32": types.uint32, "int64": types.int64,
    "uint64": types.uint64, "float32": types.float32, "float64": types.float64,
}  # fmt: skip
"""rmw_cyclonedds tells ``byte`` and ``char`` as ``uint8`` too (its ``dyntype.cpp``)."""
_NAMES = {id(kind): name for name, kind in _PRIMITIVES.items() if name not in ("byte", "char")}
_NAMES |= {id(int): "int64", id(float): "float64"}

_OF_SERVICES = ("_Request", "_Response")
_SERVICE_HEADER = {"_client_guid": types.uint64, "_request_number": types.int64}


class WireSample:
    """A message's bytes as Cyclone hands them over; it adds ``sample_info``."""

    __slots__ = ("data", "sample_info")

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.sample_info: Any = None


class WireTypes:
    """Makes a type once for each name: a participant knows one type by one name."""

    def __init__(self, book: TypeBook) -> None:
        self._book = book
        self._made: dict[str, Any] = {}
        self._lock = threading.Lock()

    def of(self, name: str) -> Any:
        """The class that Cyclone's topic takes. One of a request or reply begins with the header that rmw_cyclonedds
        puts there. Raises :class:`DefinitionError`."""
        with self._lock:
            if name not in self._made:
                self._book.closure(name)
                header = _SERVICE_HEADER if name.endswith(_OF_SERVICES) else {}
                self._made[name] = _sent_as_bytes(self._struct(name, {}, header))
            return self._made[name]

    def _struct(self, name: str, inner: dict[str, Any], header: Mapping[str, Any] = MappingProxyType({})) -> Any:
        if name not in inner:
            definition = self._book.find(name)
            own_fields = {field.name: self._idl_type(field.type, inner) for field in definition.fields}
            fields = {**header, **own_fields}
            own = name.rsplit("/", 1)[-1]
            made = make_idl_struct(f"{own}_", dds_name(name).replace("::", "."), fields, dataclassify=False)
            inner[name] = final(made)
        return inner[name]

    def _idl_type(self, kind: FieldType, inner: dict[str, Any]) -> Any:
        if kind.base == "wstring":
            raise DefinitionError("text of wide characters (wstring) can't be sent over DDS from Python")
        if kind.is_text:
            one: Any = types.bounded_str[kind.text_bound] if kind.text_bound else str
        else:
            one = _PRIMITIVES.get(kind.base) or self._struct(kind.base, inner)
        if kind.shape == "array":
            return types.array[one, kind.size]
        if kind.shape == "sequence":
            return types.sequence[one, kind.size] if kind.size else types.sequence[one]
        return one


def _sent_as_bytes(struct: type[IdlStruct]) -> type[IdlStruct]:
    """The same type, whose samples are made from bytes and give them back. Cyclone's readers and writers call just
    these three methods; the last one for the news that a writer is gone, which has no message."""

    def deserialize(cls: Any, /, data: bytes, **_: Any) -> WireSample:
        return WireSample(data)

    def serialize(self: Any, **_: Any) -> bytes:
        return bytes(self.data)

    def deserialize_key(cls: Any, /, data: bytes, **_: Any) -> None:
        return None

    made: Any = struct
    made.deserialize = classmethod(deserialize)
    made.deserialize_key = classmethod(deserialize_key)
    made.serialize = serialize
    return struct


def sample_of(struct: Any, data: bytes) -> Any:
    """What a writer of this type takes."""
    sample = struct.__new__(struct)
    sample.data = data
    return sample


def definitions_of(struct: Any) -> list[Definition]:
    """The definitions of a type that was discovered, itself first. Raises :class:`DefinitionError` for what ROS does
    not have."""
    found: dict[str, Definition] = {}

    def read(one: Any) -> str:
        name = full_name(one.__idl_typename__.replace(".", "::"))
        if name not in found:
            hints = get_type_hints(one, include_extras=True)
            found[name] = Definition(name, ())  # its place, before those in it
            fields = tuple(Field(own, _field_type(hint, read)) for own, hint in hints.items())
            found[name] = Definition(name, fields)
        return name

    read(struct)
    return list(found.values())


def _field_type(hint: Any, read: Any) -> FieldType:
    inner = get_args(hint)[1] if get_origin(hint) is not None and len(get_args(hint)) > 1 else hint
    shapes: tuple[tuple[Any, FieldShape], ...] = ((types.array, "array"), (types.sequence, "sequence"))
    for holder, shape in shapes:
        if isinstance(inner, holder):
            one = _field_type(inner.subtype, read)
            size = inner.length if shape == "array" else (inner.max_length or 0)
            return FieldType(one.base, shape, size, one.text_bound)
    if isinstance(inner, types.bounded_str):
        return FieldType("string", text_bound=inner.max_length)
    if get_origin(hint) is list:
        one = _field_type(get_args(hint)[0], read)
        return FieldType(one.base, "sequence", 0, one.text_bound)
    for kind in (hint, inner):
        if id(kind) in _NAMES:
            return FieldType(_NAMES[id(kind)])
        if kind is str:
            return FieldType("string")
        if isinstance(kind, type) and issubclass(kind, IdlStruct):
            return FieldType(read(kind))
    raise DefinitionError(f"a type {hint!r:.60} that ROS does not have")
