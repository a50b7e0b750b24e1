"""What one peer has sent in part: bounded over its channels, forgotten in time, and told to it when it is forgotten."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable

from mosaic_core.machines.delivery.framing import FrameReader
from mosaic_core.machines.delivery.reassembly import Partials
from mosaic_core.runtime.timing.deadline_timer import DeadlineTimer

_SLACK_S = 0.05
"""Clocks of event loops are coarse."""


class PeerPartials:
    """Bounds and forgets what one peer has sent in part. Event loop only. ``forgotten(label, seq)``: the rest of this
    message is not waited for any more."""

    def __init__(self, forgotten: Callable[[str, int], None]) -> None:
        self.shared = Partials()
        self._readers: dict[str, FrameReader] = {}
        self._forgotten = forgotten
        self._timer = DeadlineTimer(self._expire)

    def opened(self, label: str, reader: FrameReader) -> None:
        self._readers[label] = reader

    def closed(self, labels: Iterable[str]) -> None:
        """Parts on channels that are gone will never be whole."""
        for label in labels:
            reader = self._readers.pop(label, None)
            if reader is not None:
                reader.chunks.close()
        self._watch_expiry()

    def arrived(self) -> None:
        """A channel has read something that was no whole message."""
        self._tell()
        if not self._timer.is_set:
            self._watch_expiry()

    def _tell(self) -> None:
        for label, reader in tuple(self._readers.items()):
            for seq in reader.chunks.take_forgotten():
                self._forgotten(label, seq)

    def _watch_expiry(self) -> None:
        expiry_s = self.shared.next_expiry_s
        self._timer.set(None if expiry_s is None else expiry_s + _SLACK_S)

    def _expire(self) -> None:
        self.shared.expire(time.monotonic())
        self._tell()
        self._watch_expiry()
