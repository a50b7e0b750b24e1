"""What one peer has sent in part: bounded over its channels, forgotten in time, and told to it when it is forgotten."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Iterable

from mosaic_core.machines.delivery.framing import FrameReader
from mosaic_core.machines.delivery.reassembly import Partials

_SLACK_S = 0.05
"""Clocks of event loops are coarse."""


class PeerPartials:
    """Of one peer; event loop only. ``forgotten(label, seq)``: the rest of this message is not waited for any more."""

    def __init__(self, forgotten: Callable[[str, int], None]) -> None:
        self.shared = Partials()
        self._readers: dict[str, FrameReader] = {}
        self._forgotten = forgotten
        self._timer: asyncio.TimerHandle | None = None

    def opened(self, label: str, reader: FrameReader) -> None:
        self._readers[label] = reader

    def closed(self, labels: Iterable[str]) -> None:
        """Parts on channels that are gone will never be whole."""
        for label in labels:
            reader = self._readers.pop(label, None)
            if reader is not None:
                reader.chunks.close()
        self._rearm()

    def arrived(self) -> None:
        """A channel has read something that was no whole message."""
        self._tell()
        if self._timer is None:
            self._rearm()

    def _tell(self) -> None:
        for label, reader in tuple(self._readers.items()):
            for seq in reader.chunks.take_forgotten():
                self._forgotten(label, seq)

    def _rearm(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        expiry_s = self.shared.next_expiry_s
        if expiry_s is not None:
            wait_s = max(0.0, expiry_s - time.monotonic()) + _SLACK_S
            self._timer = asyncio.get_running_loop().call_later(wait_s, self._expire)

    def _expire(self) -> None:
        self._timer = None
        self.shared.expire(time.monotonic())
        self._tell()
        self._rearm()
