"""Counts what one store has received and sent, over all its channels and connections."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

from mosaic_core.machines.delivery.arrivals import ArrivalCounters
from mosaic_core.runtime.observation.counters import RateMeter


@dataclass(slots=True)
class StoreCounters:
    """Counts a store's messages and bytes: written by the connection, read by programs. Event loop only."""

    received: int = 0
    received_bytes: int = 0
    arrivals: ArrivalCounters = field(default_factory=ArrivalCounters)
    """What was missed and what came late, as the numbers of the messages tell; nothing of original robots."""
    incomplete: int = 0
    """Large messages of which only parts arrived."""
    sent: int = 0
    sent_bytes: int = 0
    replaced: int = 0
    """Accepted, but a newer value took their place before they left."""
    refused: int = 0
    """Not accepted: the channel was not open, or too much was waiting."""
    last_received_s: float | None = None
    """When the last message came, on this program's monotonic clock."""
    incoming: RateMeter = field(default_factory=RateMeter)
    outgoing: RateMeter = field(default_factory=RateMeter)

    def got(self, size_bytes: int) -> None:
        now_s = time.monotonic()
        self.received += 1
        self.received_bytes += size_bytes
        self.last_received_s = now_s
        self.incoming.add(size_bytes, now_s)

    def gave(self, size_bytes: int) -> None:
        self.sent += 1
        self.sent_bytes += size_bytes
        self.outgoing.add(size_bytes, time.monotonic())
