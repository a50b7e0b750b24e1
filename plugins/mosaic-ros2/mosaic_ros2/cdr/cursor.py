"""Walks through the bytes of a CDR message (OMG DDSI-RTPS 10.2, DDS-XTypes 7.4): byte order and alignment.

Classic CDR aligns numbers to their size, up to 8; XCDR2's plain form up to 4. ROS 2 sends the first one.
"""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

HEADER_BYTES = 4
_FORMS = {0x0000: (">", 8), 0x0001: ("<", 8), 0x0006: (">", 4), 0x0007: ("<", 4)}
"""Representation identifier → byte order, and the largest alignment."""
LITTLE_ENDIAN_HEADER = b"\x00\x01\x00\x00"


class CdrError(ValueError):
    """Bytes that are no message of the type they should be, or a value that its type can't hold."""


class CdrCursor:
    """The place in a message that is being read."""

    __slots__ = ("at", "body", "most", "order")

    def __init__(self, data: bytes | memoryview) -> None:
        """``data`` with its header of four bytes."""
        view = memoryview(data)
        if len(view) < HEADER_BYTES:
            raise CdrError(f"{len(view)} bytes are no CDR message")
        form = _FORMS.get(view[0] << 8 | view[1])
        if form is None:
            raise CdrError(f"its first bytes {view[:2].hex()} name no plain CDR")
        self.order, self.most = form
        self.body = view[HEADER_BYTES:]
        self.at = 0

    def align(self, size: int) -> None:
        """Go on to the next multiple of ``size``."""
        step = min(size, self.most)
        self.at += -self.at % step

    def take(self, count: int) -> memoryview:
        """The next ``count`` bytes. Raises :class:`CdrError` if there are fewer."""
        end = self.at + count
        if end > len(self.body):
            raise CdrError(f"it ends after {len(self.body)} bytes, where {end} are needed")
        taken = self.body[self.at : end]
        self.at = end
        return taken

    def count(self, least_bytes: int) -> int:
        """The number of elements of a sequence, each of which takes ``least_bytes`` at least."""
        self.align(4)
        found: int = struct.unpack_from(self.order + "I", self.take(4))[0]
        if found * least_bytes > len(self.body) - self.at:
            raise CdrError(f"a sequence says that it has {found} elements, and {len(self.body) - self.at} bytes follow")
        return found

    def numbers(self, dtype: str, size: int, count: int) -> NDArray[Any]:
        """``count`` numbers as an array that looks at the message's own bytes."""
        if count:
            self.align(size)
        return np.frombuffer(self.take(count * size), dtype=(self.order if size > 1 else "|") + dtype)

    def is_at_end(self) -> bool:
        """Whether no more than the padding of DDS is left."""
        return len(self.body) - self.at < HEADER_BYTES
