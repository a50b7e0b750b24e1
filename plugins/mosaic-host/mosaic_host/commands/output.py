"""Keeps the end of what a program says. Pure."""

from __future__ import annotations


class KeptOutput:
    """The last ``max_bytes`` of an output, however much it is."""

    def __init__(self, max_bytes: int) -> None:
        self._max_bytes = max_bytes
        self._kept = b""
        self.total_bytes = 0

    def add(self, piece: bytes) -> None:
        self.total_bytes += len(piece)
        self._kept = (self._kept + piece)[-self._max_bytes :]

    @property
    def is_cut(self) -> bool:
        """Whether the beginning is missing."""
        return self.total_bytes > len(self._kept)

    def text(self, max_bytes: int | None = None) -> str:
        """The end of it as text; what is no UTF-8 becomes �."""
        return self._kept[-(max_bytes or self._max_bytes) :].decode(errors="replace")
