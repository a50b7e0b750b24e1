"""Reads the parts that all cloud files share: bounds, header lines, and rows of text or bytes to structured arrays."""

from __future__ import annotations

import io
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

MAX_FILE_BYTES = 512 * 1024 * 1024
MAX_POINTS = 32_000_000
_MAX_HEADER_BYTES = 64 * 1024


class CloudFileError(ValueError):
    """A file holds no point cloud that can be read; the text says which and why."""


@dataclass(frozen=True, slots=True)
class Column:
    """One field of a point: its name, and its type as numpy spells it. ``count`` > 1: so many values in a row."""

    name: str
    type: str
    count: int = 1


def header_lines(data: bytes, last: str) -> tuple[list[str], int]:
    """The header's lines up to and with the one that begins with ``last``, and where the data begins."""
    end = data.find(last.encode(), 0, _MAX_HEADER_BYTES)
    newline = data.find(b"\n", end, _MAX_HEADER_BYTES) if end >= 0 else -1
    if newline < 0:
        raise CloudFileError(f"its header has no line '{last}'")
    text = data[: newline + 1].decode("ascii", errors="replace")
    return [line.strip() for line in text.splitlines()], newline + 1


def counted(text: str, what: str) -> int:
    """A number of points from a header."""
    if not text.isascii() or not text.isdigit() or len(text) > 12:
        raise CloudFileError(f"{what} is {text!r}, not a number")
    count = int(text)
    if count > MAX_POINTS:
        raise CloudFileError(f"{what} is {count}; {MAX_POINTS} are the most")
    return count


def record_type(columns: list[Column], byte_order: str = "<") -> np.dtype[np.void]:
    """The structured type of one record; names that come twice, as PCL's padding does, are told apart."""
    seen: set[str] = set()
    fields: list[tuple[str, str, tuple[int, ...]]] = []
    for number, column in enumerate(columns):
        name = column.name if column.name not in seen else f"{column.name}#{number}"
        seen.add(name)
        fields.append((name, byte_order + column.type, () if column.count == 1 else (column.count,)))
    return np.dtype(fields)


def records_of_bytes(data: bytes, start: int, count: int, kind: np.dtype[np.void]) -> NDArray[np.void]:
    """``count`` binary records."""
    if start + count * kind.itemsize > len(data):
        have = max(0, len(data) - start) // max(kind.itemsize, 1)
        raise CloudFileError(f"it ends after {have} of {count} points")
    return np.frombuffer(data, dtype=kind, count=count, offset=start)


def records_of_text(data: bytes, count: int, kind: np.dtype[np.void]) -> NDArray[np.void]:
    """``count`` rows of numbers, separated by white space."""
    records = np.zeros(count, dtype=kind)
    if count == 0:
        return records
    try:
        text = io.StringIO(data.decode("ascii"))
        rows = np.loadtxt(text, dtype=np.float64, max_rows=count, ndmin=2, comments=None)
    except (ValueError, UnicodeDecodeError) as error:
        raise CloudFileError(f"its text can't be read: {error}") from None
    if len(rows) < count:
        raise CloudFileError(f"it ends after {len(rows)} of {count} points")
    at = 0
    for name in kind.names or ():
        shape = kind[name].shape
        width = shape[0] if shape else 1
        if at + width > rows.shape[1]:
            raise CloudFileError(f"its rows have {rows.shape[1]} values, fewer than its fields")
        with np.errstate(invalid="ignore", over="ignore"):  # NaN or too much for an integer of the file
            records[name] = rows[:, at : at + width] if shape else rows[:, at]
        at += width
    return records
