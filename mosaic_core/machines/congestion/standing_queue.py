"""Keeps the queue short that a flow of ours makes for itself in front of the narrowest link of its path.

Loss-based congestion control fills such a queue until it overflows: on a home router that is half a second, in which
the picture and every word of the robot wait too. The round trip tells how long the queue is (as in LEDBAT, RFC 6817,
and HyStart, RFC 9406): what never falls below the target for a whole round trip is a standing queue, not a burst.
"""

from __future__ import annotations

TARGET_S = 0.02
"""How long packets may stand in the queue: no link idles, and nobody notices."""
BACKGROUND_TARGET_S = 0.007
"""For what may wait: beside a flow that bears :data:`TARGET_S` it goes back to the little that is always on its way."""
MEMORY_S = 30.0
"""A path may change; the shortest round trip is of the last one or two of these."""


class StandingQueue:
    """Bounds the queue that one SCTP association makes. ``now_s`` is any monotonic clock."""

    def __init__(self, target_s: float = TARGET_S) -> None:
        self.target_s = target_s
        self._shortest_s = float("inf")
        self._shortest_now_s = float("inf")
        self._renewed_at_s: float | None = None
        self._round_least_s = float("inf")
        self._round_ends_at_s: float | None = None

    def heard(self, round_trip_s: float, now_s: float, *, is_full: bool) -> float | None:
        """A round trip was measured, with a full window or not. The share of the window that
        drains the queue to half of the target, at most once per round trip; ``None``: leave the window alone."""
        self._remember(round_trip_s, now_s)
        if not is_full:
            return None
        self._round_least_s = min(self._round_least_s, round_trip_s)
        if self._round_ends_at_s is None:
            self._round_ends_at_s = now_s + round_trip_s
        if now_s < self._round_ends_at_s:
            return None
        least_s = self._round_least_s
        self._round_least_s, self._round_ends_at_s = float("inf"), None
        if least_s - self._base_s <= self.target_s:
            return None
        return (self._base_s + self.target_s / 2) / least_s

    @property
    def _base_s(self) -> float:
        return min(self._shortest_s, self._shortest_now_s)

    def _remember(self, round_trip_s: float, now_s: float) -> None:
        if self._renewed_at_s is None or now_s - self._renewed_at_s >= MEMORY_S:
            self._shortest_s, self._shortest_now_s = self._shortest_now_s, float("inf")
            self._renewed_at_s = now_s
        self._shortest_now_s = min(self._shortest_now_s, round_trip_s)
