"""Turns registers into numbers and back: types, orders of bytes and words, scale. Pure."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence

from mosaic_modbus.params import RegisterField, WriteField

_FORMATS = {
    "int16": "h", "uint16": "H", "int32": "i", "uint32": "I", "int64": "q", "uint64": "Q", "float32": "f",
    "float64": "d",
}  # fmt: skip
LARGEST_FLOAT32 = 3.4028234e38


def width(field: RegisterField) -> int:
    """How many registers, coils or inputs it takes."""
    if field.number_type == "boolean":
        return 1
    return struct.calcsize(_FORMATS[field.number_type]) // 2


def is_whole(field: RegisterField) -> bool:
    """Whether all its values are integers."""
    is_integer = field.number_type not in ("float32", "float64", "boolean")
    return is_integer and field.scale.is_integer() and field.offset.is_integer()


def decoded(field: RegisterField, words: Sequence[int]) -> float | bool | None:
    """The value of what was read; ``None`` for a float that is no finite number."""
    if field.kind in ("coil", "discrete"):
        return bool(words[0])
    if field.bit is not None:
        return bool(_ordered(field, words)[1] >> field.bit & 1 if field.bit < 8 else
                    _ordered(field, words)[0] >> field.bit - 8 & 1)  # fmt: skip
    (raw,) = struct.unpack(f">{_FORMATS[field.number_type]}", _ordered(field, words))
    if is_whole(field):
        return int(raw) * int(field.scale) + int(field.offset)
    value = raw * field.scale + field.offset
    return value if math.isfinite(value) else None


def _ordered(field: RegisterField, words: Sequence[int]) -> bytes:
    """The bytes of ``words``, the most significant one first."""
    high_first = words if field.word_order == "big" else words[::-1]
    return b"".join(word.to_bytes(2, field.byte_order) for word in high_first)


def encoded(field: WriteField, value: float | bool) -> list[int]:
    """The registers, or the coil, that say ``value``. Raises :class:`ValueError` for what lies beyond its bounds."""
    if field.kind == "coil":
        return [int(bool(value))]
    low, high = bounds(field)
    if not low <= value <= high:
        raise ValueError(f"{value:g} is not within {low:g} to {high:g}")
    raw = (value - field.offset) / field.scale
    letter = _FORMATS[field.number_type]
    data = struct.pack(f">{letter}", raw if letter in "fd" else _nearest(field, raw))
    words = [int.from_bytes(data[at : at + 2], field.byte_order) for at in range(0, len(data), 2)]
    return words if field.word_order == "big" else words[::-1]


def _nearest(field: WriteField, raw: float) -> int:
    """The step that is nearest, within what the register holds."""
    low, high = _raw_bounds(field)
    return min(max(round(raw), int(low)), int(high))


def _raw_bounds(field: RegisterField) -> tuple[float, float]:
    letter = _FORMATS[field.number_type]
    if letter in "fd":
        largest = LARGEST_FLOAT32 if letter == "f" else 1e300
        return -largest, largest
    bits = 8 * struct.calcsize(letter)
    return (0, (1 << bits) - 1) if letter.isupper() else (-(1 << (bits - 1)), (1 << (bits - 1)) - 1)


def bounds(field: WriteField) -> tuple[float, float]:
    """What may be written: ``min`` and ``max``, as far as the registers hold it."""
    low, high = sorted(raw * field.scale + field.offset for raw in _raw_bounds(field))
    least = low if field.min is None else max(low, field.min)
    greatest = high if field.max is None else min(high, field.max)
    return float(least), float(greatest)
