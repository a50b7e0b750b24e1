"""Frame number and capture time as black and white blocks: readable by a program after any video codec.

Two rows of 40 blocks at the bottom of the picture: 32 bits of value, most significant first, and 8 bits of check.
The upper row counts frames, the lower one tenths of a millisecond of the robot's monotonic clock (both modulo 2^32).
"""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mosaic_core.contract.media import Image

VALUE_BITS, CHECK_BITS = 32, 8
COLUMNS = VALUE_BITS + CHECK_BITS
ROWS = 2
TICK_S = 1e-4
WRAP = 2**VALUE_BITS


@dataclass(frozen=True, slots=True)
class Marks:
    """The marks that :func:`read_marks` found in a picture; ``captured_at_s`` wraps every 119 hours."""

    frame: int
    captured_at_s: float


def block_height(height: int) -> int:
    """Pixels per row of blocks for a picture of ``height`` pixels; never under 8, which codecs keep intact."""
    return max(8, height // 30)


def draw_marks(image: Image, frame: int, captured_at_s: float) -> None:
    """Write both rows into the bottom of ``image``, in place."""
    rows = [_bits(frame % WRAP), _bits(round(captured_at_s / TICK_S) % WRAP)]
    size = block_height(image.shape[0])
    column_of_pixel = np.arange(image.shape[1]) * COLUMNS // image.shape[1]
    for row, bits in enumerate(rows):
        top = image.shape[0] - (ROWS - row) * size
        line = bits[column_of_pixel] * np.uint8(255)
        image[top : top + size] = line if image.ndim == 2 else line[:, None]


def read_marks(image: Image) -> Marks | None:
    """The marks of a picture (BGR or gray, also scaled or compressed), or ``None`` where the check fails."""
    gray = image if image.ndim == 2 else image.mean(axis=2)
    height, width = gray.shape
    size = block_height(height)
    centres = ((np.arange(COLUMNS) + 0.5) * width / COLUMNS).astype(int)
    values = [_value(gray, height - (ROWS - row) * size + size // 2, centres) for row in range(ROWS)]
    if values[0] is None or values[1] is None:
        return None
    return Marks(values[0], values[1] * TICK_S)


def _bits(value: int) -> NDArray[np.uint8]:
    data = value.to_bytes(VALUE_BITS // 8, "big")
    return np.unpackbits(np.frombuffer(data + _check(data), dtype=np.uint8))


def _value(gray: NDArray[np.generic], row: int, centres: NDArray[np.int_]) -> int | None:
    is_white = np.asarray(gray[row, centres] > 127, dtype=np.uint8)
    data = np.packbits(is_white).tobytes()
    value, check = data[: VALUE_BITS // 8], data[VALUE_BITS // 8 :]
    return int.from_bytes(value, "big") if check == _check(value) else None


def _check(data: bytes) -> bytes:
    """The low byte of CRC-32 over the data and a constant, so that an all-black row is not valid."""
    return bytes([zlib.crc32(data + b"mosaic") & 0xFF])
