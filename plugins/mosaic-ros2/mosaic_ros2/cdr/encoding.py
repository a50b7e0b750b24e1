"""Writes CDR messages by their definition, from the ``dict`` that :mod:`mosaic_ros2.cdr.decoding` makes, or from JSON.

Fields that are left out are zero or empty, as in ROS.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import numpy as np

from mosaic_core.words.errors import hint_at
from mosaic_ros2.cdr.cursor import LITTLE_ENDIAN_HEADER, CdrError
from mosaic_ros2.cdr.decoding import CODES, DTYPES
from mosaic_ros2.definitions.definition import NUMBERS, Definition, FieldType
from mosaic_ros2.definitions.type_book import TypeBook

Writer: TypeAlias = Callable[[bytearray, Any], None]


class CdrEncoder:
    """Encodes messages of one type, little-endian. Any thread."""

    def __init__(self, book: TypeBook, name: str) -> None:
        """Raises :class:`~mosaic_ros2.definitions.definition.DefinitionError`."""
        self.name = name
        book.closure(name)
        self._write = _struct_writer(book, book.find(name))

    def encode(self, message: Mapping[str, Any]) -> bytes:
        """The message with CDR's header. Raises :class:`CdrError` that names the field."""
        body = bytearray()
        try:
            self._write(body, message)
        except CdrError as error:
            raise CdrError(f"no {self.name}: {error}") from None
        return LITTLE_ENDIAN_HEADER + bytes(body)


def _struct_writer(book: TypeBook, definition: Definition) -> Writer:
    writers = {field.name: _writer(book, field.type) for field in definition.fields}

    def write(out: bytearray, message: Any) -> None:
        if message is None:
            message = {}
        if not isinstance(message, Mapping):
            raise CdrError(f"{message!r:.40} where {definition.name} is expected")
        unknown = next((name for name in message if name not in writers), None)
        if unknown is not None:
            raise CdrError(f"no field {unknown!r:.40}{hint_at(str(unknown)[:64], writers)}")
        for name, write_one in writers.items():
            try:
                write_one(out, message.get(name))
            except CdrError as error:
                raise CdrError(f"{name}: {error}") from None
            except (struct.error, TypeError, ValueError, OverflowError) as error:
                raise CdrError(f"{name}: {error}") from None

    return write


def _pad(out: bytearray, size: int) -> None:
    out.extend(bytes(-len(out) % size))


def _writer(book: TypeBook, kind: FieldType) -> Writer:
    if kind.is_number and kind.shape != "one":
        return _numbers_writer(kind)
    one = _number_writer(kind.base) if kind.is_number else _other_writer(book, kind)
    if kind.shape == "one":
        return one

    def write(out: bytearray, values: Any) -> None:
        items = [None] * kind.size if values is None and kind.shape == "array" else list(values or ())
        _check_length(kind, len(items))
        if kind.shape == "sequence":
            _write_count(out, len(items))
        for item in items:
            one(out, item)

    return write


def _check_length(kind: FieldType, length: int) -> None:
    if kind.shape == "array" and length != kind.size:
        raise CdrError(f"{length} elements where {kind.size} are expected")
    if kind.shape == "sequence" and kind.size and length > kind.size:
        raise CdrError(f"{length} elements, at most {kind.size} are allowed")


def _write_count(out: bytearray, count: int) -> None:
    _pad(out, 4)
    out.extend(struct.pack("<I", count))


def _number_writer(base: str) -> Writer:
    size, packed = NUMBERS[base], struct.Struct("<" + CODES[base])

    def write(out: bytearray, value: Any) -> None:
        _pad(out, size)
        out.extend(packed.pack(0 if value is None else value))

    return write


def _numbers_writer(kind: FieldType) -> Writer:
    size, dtype = NUMBERS[kind.base], np.dtype("<" + DTYPES[kind.base])

    def write(out: bytearray, values: Any) -> None:
        array = _array(kind, dtype, values)
        _check_length(kind, len(array))
        if kind.shape == "sequence":
            _write_count(out, len(array))
        if len(array):
            _pad(out, size)
            out.extend(array.data.cast("B"))

    return write


def _array(kind: FieldType, dtype: np.dtype[Any], values: Any) -> Any:
    if values is None:
        return np.zeros(kind.size if kind.shape == "array" else 0, dtype)
    if isinstance(values, bytes | bytearray | memoryview):
        return np.frombuffer(values, dtype)
    array = np.asarray(values)
    if array.ndim != 1 or (array.size and array.dtype.kind not in "fiub"):
        raise CdrError("a list of numbers is expected")
    converted = np.ascontiguousarray(array, dtype) if array.size else np.zeros(0, dtype)
    if dtype.kind in "iu" and not np.array_equal(converted, array):
        raise CdrError(f"numbers that no {kind.base} can hold")
    return converted


def _other_writer(book: TypeBook, kind: FieldType) -> Writer:
    if kind.is_message:
        return _struct_writer(book, book.find(kind.base))
    return _text_writer(kind.text_bound) if kind.base == "string" else _wide_text_writer


def _text_writer(bound: int) -> Writer:
    def write(out: bytearray, value: Any) -> None:
        if not isinstance(value, str | None):
            raise CdrError(f"{value!r:.40} where text is expected")
        data = (value or "").encode()
        if b"\0" in data or (bound and len(data) > bound):
            raise CdrError(
                f"text with a zero in it, or longer than {bound} bytes" if bound else "text with a zero in it"
            )
        _write_count(out, len(data) + 1)
        out.extend(data + b"\0")

    return write


def _wide_text_writer(out: bytearray, value: Any) -> None:
    units = np.frombuffer((value or "").encode("utf-16-le"), "<u2").astype("<u4")
    _write_count(out, len(units))
    out.extend(units.tobytes())
