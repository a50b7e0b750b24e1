"""Whether deflating pays: measured on the data as it comes, compared with what the saved bytes would cost to send."""

from __future__ import annotations

from typing import Literal, TypeAlias

Compress: TypeAlias = Literal["auto", "never", "always"]

SENDING_S_PER_BYTE = 60e-9
"""What a byte costs this computer to send to one operator: 720–1650 µs per 16 KiB in Python's SCTP (measured)."""
LEAST_GAIN = 0.05
"""Saving less than this share isn't worth the other side's work."""
LOOK_AGAIN = 32
"""After so many messages that were not deflated one is, to see whether that has changed."""
_SMOOTHING = 0.25


class Deflation:
    """Decides for one connector, message by message. Not thread-safe; knows no clock."""

    def __init__(self, compress: Compress = "auto") -> None:
        self._compress = compress
        self._kept_share = 0.5
        self._s_per_byte = 0.0
        self._skipped = 0

    def pays(self, size_bytes: int) -> bool:
        """Whether to try it with the next message of this size."""
        if self._compress != "auto":
            return self._compress == "always" and size_bytes > 0
        if size_bytes == 0:
            return False
        gain = 1.0 - self._kept_share
        if gain >= LEAST_GAIN and gain * SENDING_S_PER_BYTE > self._s_per_byte:
            return True
        self._skipped += 1
        return self._skipped % LOOK_AGAIN == 0

    def note(self, size_bytes: int, deflated_bytes: int, spent_s: float) -> None:
        """What a try came to."""
        self._kept_share += _SMOOTHING * (deflated_bytes / size_bytes - self._kept_share)
        self._s_per_byte += _SMOOTHING * (spent_s / size_bytes - self._s_per_byte)

    def keeps(self, size_bytes: int, deflated_bytes: int) -> bool:
        """Whether the deflated form is the one to send."""
        return self._compress == "always" or deflated_bytes <= size_bytes * (1.0 - LEAST_GAIN)
