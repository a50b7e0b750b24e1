"""Letters of 5 x 7 squares, for what the test pattern writes into itself.

OpenCV's ``putText`` unpacks outline fonts that stay in memory: 8 MB for these twenty-seven signs.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mosaic_core.contract.media import Image

COLUMNS, ROWS = 5, 7
_GAP = 1
"""Empty columns after every sign."""
GLYPHS = {
    "0": "0E 11 13 15 19 11 0E", "1": "04 0C 04 04 04 04 0E", "2": "0E 11 01 02 04 08 1F", "3": "1F 02 04 02 01 11 0E",
    "4": "02 06 0A 12 1F 02 02", "5": "1F 10 1E 01 01 11 0E", "6": "06 08 10 1E 11 11 0E", "7": "1F 01 02 04 08 08 08",
    "8": "0E 11 11 0E 11 11 0E", "9": "0E 11 11 0F 01 02 0C", ":": "00 0C 0C 00 0C 0C 00", ".": "00 00 00 00 00 0C 0C",
    "-": "00 00 00 1F 00 00 00", "M": "11 1B 15 15 11 11 11", "O": "0E 11 11 11 11 11 0E", "S": "0F 10 10 0E 01 01 1E",
    "A": "0E 11 11 11 1F 11 11", "I": "0E 04 04 04 04 04 0E", "C": "0E 11 10 10 10 11 0E", "x": "00 00 11 0A 04 0A 11",
    "f": "06 09 08 1C 08 08 08", "r": "00 00 16 19 10 10 10", "a": "00 00 0E 01 0F 11 0F", "m": "00 00 1A 15 15 11 11",
    "e": "00 00 0E 11 1F 10 0E", "p": "00 00 1E 11 1E 10 10", "s": "00 00 0E 10 0E 01 1E",
}  # fmt: skip
"""A byte for every row, from the top; the five low bits are its squares, the highest of them on the left."""


def write_text(image: Image, text: str, left: int, top: int, square: int) -> None:
    """Write white signs of ``square`` pixels a square into ``image``, in place. What has no glyph is a blank; what
    would lie beyond the picture is cut off."""
    mask = text_mask(text).repeat(square, axis=0).repeat(square, axis=1)
    place = image[top : top + mask.shape[0], left : left + mask.shape[1]]
    place[mask[: place.shape[0], : place.shape[1]]] = 255


def text_mask(text: str) -> NDArray[np.bool_]:
    """The squares of one line of text, ``True`` where they are white."""
    mask = np.zeros((ROWS, len(text) * (COLUMNS + _GAP)), dtype=bool)
    for index, sign in enumerate(text):
        rows = np.frombuffer(bytes.fromhex(GLYPHS.get(sign, "00" * ROWS)), dtype=np.uint8)
        left = index * (COLUMNS + _GAP)
        mask[:, left : left + COLUMNS] = np.unpackbits(rows[:, None], axis=1)[:, -COLUMNS:]
    return mask
