"""Writes what is said into a WAV file that is complete at every moment."""

from __future__ import annotations

import struct
from pathlib import Path

from mosaic_core import Sound

MAX_S = 3600.0
"""An hour at 48 kHz stereo is 690 MB; what is said after that is not written any more."""
_HEADER_BYTES = 44


class WavSink:
    """A WAV file as a loudspeaker: made anew by the first sound; later talks are written behind it."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._size_bytes = 0
        self._written_s = 0.0

    def play(self, sound: Sound) -> None:
        if self._written_s >= MAX_S:
            return
        data = sound.samples.astype("<i2", copy=False).tobytes()
        with self._path.open("r+b" if self._size_bytes else "wb") as file:
            file.seek(_HEADER_BYTES + self._size_bytes)
            file.write(data)
            self._size_bytes += len(data)
            file.seek(0)
            file.write(_header(sound.samples.shape[1], sound.rate_hz, self._size_bytes))
        self._written_s += sound.duration_s

    def rest(self) -> None:
        """Nothing is open."""


def _header(channels: int, rate_hz: int, size_bytes: int) -> bytes:
    """RIFF, ``fmt`` (PCM, 16 bits) and the head of ``data``."""
    shape = struct.pack("<HHIIHH", 1, channels, rate_hz, rate_hz * channels * 2, channels * 2, 16)
    riff = b"RIFF" + struct.pack("<I", 36 + size_bytes) + b"WAVE"
    return riff + b"fmt " + struct.pack("<I", len(shape)) + shape + b"data" + struct.pack("<I", size_bytes)
