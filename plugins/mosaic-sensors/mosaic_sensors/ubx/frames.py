"""Finds UBX frames between whatever else a receiver says. Pure; what is in them is pyubx2's business.

B5 62, class, id, length (two bytes, little-endian), payload, two bytes of checksum. Beside them a receiver speaks NMEA.
"""

from __future__ import annotations

from collections.abc import Iterator

from pyubx2 import calc_checksum  # type: ignore[import-untyped]

SYNC = b"\xb5\x62"
MAX_PAYLOAD = 4096
"""Raw measurements of all satellites take less. A longer one is noise, which must not be waited for."""
_HEADER, _CHECKSUM = 6, 2


class UbxFrames:
    """Collects bytes into frames whose checksum is right; ``bad_frames`` counts the others."""

    def __init__(self) -> None:
        self.bad_frames = 0
        self._rest = b""

    def feed(self, data: bytes) -> Iterator[bytes]:
        """The frames that ``data`` ends, wherever the stream is cut."""
        self._rest += data
        while True:
            start = self._rest.find(SYNC)
            if start < 0:
                self._rest = self._rest[-1:] if self._rest.endswith(SYNC[:1]) else b""
                return
            self._rest = self._rest[start:]
            length = int.from_bytes(self._rest[4:_HEADER], "little")
            whole = _HEADER + length + _CHECKSUM
            if length <= MAX_PAYLOAD and (len(self._rest) < _HEADER or len(self._rest) < whole):
                return
            frame = self._rest[:whole]
            if length <= MAX_PAYLOAD and calc_checksum(frame[2:-_CHECKSUM]) == frame[-_CHECKSUM:]:
                self._rest = self._rest[whole:]
                yield frame
            else:
                self.bad_frames += 1
                self._rest = self._rest[len(SYNC) :]
