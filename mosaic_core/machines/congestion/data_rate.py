"""Counts the ordinary data of one connection: it leaves beside the pictures, and no report of their arrivals tells of
it.
"""

from __future__ import annotations

from collections import deque

SLOT_S = 0.05
"""What leaves within it is counted as one: thousands of packets leave per second."""
_SLOTS = 20


class DataRate:
    """Measures what messages took during the last second. ``now_s``: any monotonic clock."""

    def __init__(self) -> None:
        self._slots: deque[tuple[int, int]] = deque()

    def left(self, size_bytes: int, now_s: float) -> None:
        """A packet of messages has left."""
        slot = int(now_s / SLOT_S)
        if self._slots and self._slots[-1][0] == slot:
            self._slots[-1] = (slot, self._slots[-1][1] + size_bytes)
        else:
            self._forget(slot)
            self._slots.append((slot, size_bytes))

    def bps(self, now_s: float) -> float:
        self._forget(int(now_s / SLOT_S))
        return sum(size_bytes for _, size_bytes in self._slots) * 8 / (_SLOTS * SLOT_S)

    def _forget(self, slot: int) -> None:
        while self._slots and self._slots[0][0] <= slot - _SLOTS:
            self._slots.popleft()
