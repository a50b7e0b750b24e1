"""A time burnt into a picture, in cells so large that coding and scaling do not blur them away."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

_BITS = 24
_CHECK_BITS = 8
_CELLS = _BITS + _CHECK_BITS
HEIGHT_SHARE = 1 / 15
"""Of the picture, at its top."""
_WRAP_MS = 1 << _BITS


def burn(image: NDArray[Any], at_s: float) -> None:
    """Write ``at_s`` into the top of ``image`` (height × width × 3, BGR), in milliseconds modulo 4.6 hours."""
    height, width = image.shape[:2]
    value = int(at_s * 1000) % _WRAP_MS
    word = value << _CHECK_BITS | _checksum(value)
    bits = [(word >> number) & 1 for number in range(_CELLS)]
    cells = np.array(bits, np.uint8) * 255
    image[: int(height * HEIGHT_SHARE)] = cells[np.arange(width) * _CELLS // width][None, :, None]


def read_age_ms(luma: NDArray[Any], now_s: float) -> float | None:
    """How long ago, at ``now_s``, the time in ``luma`` (height × width) was; ``None``: it can't be read."""
    height, width = luma.shape
    row = luma[int(height * HEIGHT_SHARE / 2)]
    centres = (np.arange(_CELLS) * 2 + 1) * width // (2 * _CELLS)
    word = sum(1 << number for number, value in enumerate(row[centres]) if value > 127)
    value, check = word >> _CHECK_BITS, word & (1 << _CHECK_BITS) - 1
    if check != _checksum(value):
        return None
    return float((now_s * 1000 - value) % _WRAP_MS)


def _checksum(value: int) -> int:
    """Unlike a plain sum it is not right for black and for white."""
    return (value * 167 + (value >> 8) * 59 + (value >> 16) * 13 + 0x5A) & 0xFF
