"""PLY: text, or binary of either byte order; only its vertices are read."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mosaic_sensors.point_cloud.file_bytes import (
    CloudFileError,
    Column,
    counted,
    header_lines,
    record_type,
    records_of_bytes,
    records_of_text,
)

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
_ORDERS = {"ascii": "<", "binary_little_endian": "<", "binary_big_endian": ">"}


def ply_points(data: bytes) -> NDArray[np.void]:
    """The vertices, with the fields that the file names. Raises :class:`CloudFileError`."""
    if not data.startswith((b"ply\n", b"ply\r")):
        raise CloudFileError("it doesn't begin with 'ply'")
    lines, start = header_lines(data, "end_header")
    form = _form(lines)
    count, columns = _vertices(lines)
    kind = record_type(columns, _ORDERS[form])
    if form == "ascii":
        return records_of_text(data[start:], count, kind)
    return records_of_bytes(data, start, count, kind)


def _form(lines: list[str]) -> str:
    form = next((line.split()[1] for line in lines if line.startswith("format ") and len(line.split()) > 1), "")
    if form not in _ORDERS:
        raise CloudFileError(f"format {form!r} is none of {', '.join(_ORDERS)}")
    return form


def _vertices(lines: list[str]) -> tuple[int, list[Column]]:
    """How many, and their properties. They must come first: what stands before them can't be skipped by its size."""
    count: int | None = None
    columns: list[Column] = []
    for words in (line.split() for line in lines):
        if words[:1] == ["element"] and len(words) == 3:
            if count is not None:
                break
            if words[1] != "vertex":
                raise CloudFileError(f"its first element is {words[1]!r}, not 'vertex'")
            count = counted(words[2], "the number of vertices")
        elif words[:1] == ["property"] and count is not None:
            columns.append(_column(words))
    if count is None:
        raise CloudFileError("it has no element 'vertex'")
    return count, columns


def _column(words: list[str]) -> Column:
    if len(words) != 3 or words[1] not in _TYPES:
        raise CloudFileError(f"'{' '.join(words)}' is no property that a point can have")
    return Column(words[2], _TYPES[words[1]])
