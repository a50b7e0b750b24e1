"""PCD, PCL's format: text, binary and binary_compressed."""

from __future__ import annotations

import struct

import numpy as np
from numpy.typing import NDArray

from mosaic_sensors.point_cloud.file_bytes import (
    MAX_FILE_BYTES,
    CloudFileError,
    Column,
    counted,
    header_lines,
    record_type,
    records_of_bytes,
    records_of_text,
)
from mosaic_sensors.point_cloud.lzf import lzf_decompressed

_TYPES = {f"{letter}{size}" for letter, sizes in (("f", "48"), ("i", "1248"), ("u", "1248")) for size in sizes}
_MAX_COUNT = 4096
"""Values of one field: a histogram descriptor has some hundreds."""
_SIZES = struct.Struct("<II")


def pcd_points(data: bytes) -> NDArray[np.void]:
    """The points, with the fields that the file names. Raises :class:`CloudFileError`."""
    lines, start = header_lines(data, "DATA")
    header = {words[0].upper(): words[1:] for words in (line.split() for line in lines) if words and words[0] != "#"}
    columns = _columns(header)
    count = _count(header)
    kind = record_type(columns)
    form = (header.get("DATA") or [""])[0].lower()
    if form == "ascii":
        return records_of_text(data[start:], count, kind)
    if form == "binary":
        return records_of_bytes(data, start, count, kind)
    if form == "binary_compressed":
        return _decompressed(data, start, count, kind)
    raise CloudFileError(f"DATA is {form!r}, none of ascii, binary, binary_compressed")


def _columns(header: dict[str, list[str]]) -> list[Column]:
    names = header.get("FIELDS", header.get("COLUMNS", []))
    sizes, types = header.get("SIZE", []), header.get("TYPE", [])
    counts = header.get("COUNT", ["1"] * len(names))
    if not names or not len(names) == len(sizes) == len(types) == len(counts):
        raise CloudFileError("FIELDS, SIZE, TYPE and COUNT name different numbers of fields, or none")
    columns = []
    for name, size, letter, count in zip(names, sizes, types, counts, strict=True):
        kind = f"{letter.lower()}{size}"
        if kind not in _TYPES:
            raise CloudFileError(f"the field {name!r} has TYPE {letter} and SIZE {size}, which is no number")
        if not 1 <= counted(count, f"COUNT of {name!r}") <= _MAX_COUNT:
            raise CloudFileError(f"COUNT of {name!r} is {count}")
        columns.append(Column(name, kind, int(count)))
    return columns


def _count(header: dict[str, list[str]]) -> int:
    if points := header.get("POINTS"):
        return counted(points[0], "POINTS")
    if "WIDTH" not in header or not header["WIDTH"]:
        raise CloudFileError("it has neither POINTS nor WIDTH")
    width, height = header["WIDTH"][0], (header.get("HEIGHT") or ["1"])[0]
    return counted(str(counted(width, "WIDTH") * counted(height, "HEIGHT")), "WIDTH times HEIGHT")


def _decompressed(data: bytes, start: int, count: int, kind: np.dtype[np.void]) -> NDArray[np.void]:
    """One LZF block in which each field stands in a row for all points."""
    if len(data) < start + _SIZES.size:
        raise CloudFileError("it ends before its compressed data")
    packed, size = _SIZES.unpack_from(data, start)
    if size != count * kind.itemsize or size > MAX_FILE_BYTES:
        raise CloudFileError(f"its compressed data announces {size} bytes for {count} points of {kind.itemsize}")
    block = data[start + _SIZES.size : start + _SIZES.size + packed]
    if len(block) < packed:
        raise CloudFileError(f"it ends after {len(block)} of {packed} compressed bytes")
    try:
        fields = lzf_decompressed(block, size)
    except ValueError as error:
        raise CloudFileError(str(error)) from None
    records = np.empty(count, dtype=kind)
    at = 0
    for name in kind.names or ():
        records[name] = np.frombuffer(fields, dtype=kind[name], count=count, offset=at)
        at += count * kind[name].itemsize
    return records
