"""Reads the numbers of a channel's messages: which ones never came, and which came late.

A late one counted as missed before it came. Under ``latest`` it is older than what everybody has seen already, and
nobody gets it any more. ``tests/wire/arrivals.json`` is replayed by the TypeScript twin of this module too.
"""

from __future__ import annotations

from dataclasses import dataclass

from mosaic_core.machines.delivery.framing import SEQ_MODULUS, is_newer


@dataclass(slots=True)
class ArrivalCounters:
    """Sums over all channels and connections of one store."""

    missed: int = 0
    """Numbers that were skipped: lost on the way, or replaced by a newer value before they left."""
    late: int = 0
    """Came after a newer one."""


class Arrivals:
    """Counts the messages of one channel on one connection; its first one is where counting begins."""

    def __init__(self, counters: ArrivalCounters, *, newest_only: bool) -> None:
        self._counters = counters
        self._newest_only = newest_only
        self._first: int | None = None
        self._newest = 0

    def take(self, seq: int) -> bool:
        """Count a message that arrived; whether anybody still wants it."""
        if self._first is None:
            self._first = self._newest = seq
            return True
        if is_newer(seq, self._newest):
            self._counters.missed += (seq - self._newest) % SEQ_MODULUS - 1
            self._newest = seq
            return True
        self._counters.late += 1
        if is_newer(seq, self._first) and seq != self._newest:
            self._counters.missed = max(0, self._counters.missed - 1)  # a robot that repeats itself is no gain
        return not self._newest_only
