"""Cuts a stream of bytes into lines. Pure."""

from __future__ import annotations

from dataclasses import dataclass

MAX_LINE_BYTES = 1024
"""NMEA 0183 allows 82; receivers exceed it with proprietary sentences."""


@dataclass(slots=True)
class Lines:
    """Collects bytes into lines. A line that grows longer than ``max_bytes`` is thrown away up to its end, and counted
    in ``too_long``: a device that never ends a line costs no memory."""

    max_bytes: int = MAX_LINE_BYTES
    too_long: int = 0
    _rest: bytes = b""
    _is_skipping: bool = False

    def feed(self, data: bytes) -> list[bytes]:
        """The lines that ``data`` ends, without their ends; empty ones are left out."""
        *whole, self._rest = (self._rest + data).split(b"\n")
        lines = [line for line in map(self._kept, whole) if line.strip()]
        if self._is_skipping or len(self._rest) > self.max_bytes + 1:  # one more for a carriage return
            self.too_long += not self._is_skipping
            self._is_skipping, self._rest = True, b""
        return lines

    def _kept(self, line: bytes) -> bytes:
        if self._is_skipping:
            self._is_skipping = False
            return b""
        line = line.removesuffix(b"\r")
        if len(line) > self.max_bytes:
            self.too_long += 1
            return b""
        return line
