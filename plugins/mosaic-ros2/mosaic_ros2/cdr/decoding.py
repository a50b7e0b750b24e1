"""Reads CDR messages by their definition: each becomes a ``dict`` in the order of its fields.

Numbers become ``int``, ``float`` and ``bool``; arrays and sequences of numbers ``numpy`` arrays that look at the
message's own bytes, without a copy; other sequences lists.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from typing import Any, TypeAlias

from mosaic_ros2.cdr.cursor import CdrCursor, CdrError
from mosaic_ros2.definitions.definition import NUMBERS, Definition, Field, FieldType
from mosaic_ros2.definitions.type_book import TypeBook

CdrReader: TypeAlias = Callable[[CdrCursor], Any]

CODES = {
    "bool": "?", "byte": "B", "char": "B", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i",
    "uint32": "I", "int64": "q", "uint64": "Q", "float32": "f", "float64": "d",
}  # fmt: skip
"""``struct``'s letters."""
DTYPES = {
    "bool": "u1", "byte": "u1", "char": "u1", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "int64": "i8", "uint64": "u8", "float32": "f4", "float64": "f8",
}  # fmt: skip


class Decoder:
    """Decodes messages of one type. Any thread; made once, used for each message."""

    def __init__(self, book: TypeBook, name: str) -> None:
        """Raises :class:`~mosaic_ros2.definitions.definition.DefinitionError`."""
        self.name = name
        book.closure(name)
        self._read = _Struct(book, book.find(name))

    def decode(self, data: bytes | memoryview) -> dict[str, Any]:
        """The message in ``data``, which begins with CDR's header. Raises :class:`CdrError`."""
        try:
            cursor = CdrCursor(data)
            message = self._read(cursor)
            if not cursor.is_at_end():
                raise CdrError(f"{len(cursor.body) - cursor.at} bytes are left")
        except CdrError as error:
            raise CdrError(f"no {self.name}: {error}") from None
        return message


class _Struct:
    """Reads the fields of one message, those of equal size that follow each other at once."""

    def __init__(self, book: TypeBook, definition: Definition) -> None:
        self._steps: list[tuple[tuple[str, ...], CdrReader]] = []
        for fields in _runs(definition.fields):
            names = tuple(field.name for field in fields)
            single = len(fields) == 1 and not _is_plain(fields[0])
            self._steps.append((names, _reader(book, fields[0].type) if single else _run_reader(fields)))
        self.least_bytes = sum(_least_bytes(field.type) for field in definition.fields)

    def __call__(self, cursor: CdrCursor) -> dict[str, Any]:
        message: dict[str, Any] = {}
        for names, read in self._steps:
            value = read(cursor)
            if type(value) is tuple:
                message.update(zip(names, value, strict=True))
            else:
                message[names[0]] = value
        return message


def _is_plain(field: Field) -> bool:
    return field.type.is_number and field.type.shape == "one"


def _runs(fields: tuple[Field, ...]) -> Iterator[list[Field]]:
    run: list[Field] = []
    for field in fields:
        if run and not (_is_plain(field) and _is_plain(run[-1]) and _size(field) == _size(run[-1])):
            yield run
            run = []
        run.append(field)
    if run:
        yield run


def _size(field: Field) -> int:
    return NUMBERS[field.type.base]


def _run_reader(fields: list[Field]) -> CdrReader:
    size = _size(fields[0])
    codes = "".join(CODES[field.type.base] for field in fields)
    by_order = {order: struct.Struct(order + codes) for order in "<>"}
    length = size * len(fields)

    def read(cursor: CdrCursor) -> tuple[Any, ...]:
        cursor.align(size)
        return by_order[cursor.order].unpack(cursor.take(length))

    return read


def _least_bytes(kind: FieldType) -> int:
    """What one takes at least: no alignment, every sequence empty, every message a byte."""
    if kind.shape == "sequence" or kind.is_text:
        return 4
    return NUMBERS.get(kind.base, 1) * (kind.size if kind.shape == "array" else 1)


def _reader(book: TypeBook, kind: FieldType) -> CdrReader:
    if kind.is_number:
        return _numbers_reader(kind)
    if kind.is_text:
        one: CdrReader = _text if kind.base == "string" else _wide_text
        least = 4
    else:
        inner = _Struct(book, book.find(kind.base))
        one, least = inner, max(1, inner.least_bytes)
    if kind.shape == "one":
        return one
    if kind.shape == "array":
        return lambda cursor: [one(cursor) for _ in range(kind.size)]

    def read(cursor: CdrCursor) -> list[Any]:
        return [one(cursor) for _ in range(cursor.count(least))]

    return read


def _numbers_reader(kind: FieldType) -> CdrReader:
    dtype, size = DTYPES[kind.base], NUMBERS[kind.base]

    def read(cursor: CdrCursor) -> Any:
        count = kind.size if kind.shape == "array" else cursor.count(size)
        found = cursor.numbers(dtype, size, count)
        return found != 0 if kind.base == "bool" else found

    return read


def _text(cursor: CdrCursor) -> str:
    """UTF-8 with a zero behind it, which counts."""
    return bytes(cursor.take(cursor.count(1))).removesuffix(b"\0").decode("utf-8", errors="replace")


def _wide_text(cursor: CdrCursor) -> str:
    """UTF-16 code units of 4 bytes (rmw_cyclonedds, Fast DDS), without a zero behind them."""
    units = cursor.numbers("u4", 4, cursor.count(4))
    return bytes(units.astype("<u2").tobytes()).decode("utf-16-le", errors="replace")
