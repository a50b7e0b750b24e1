"""Is the base of whoever estimates how much one peer connection carries: from arrival times, or from less."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections import deque

from mosaic_core.machines.congestion.feedback import Feedback

_WINDOW_S = 1.0


class CongestionController(ABC):
    """Estimates what one peer connection may send; all of its streams are one to it. ``now_s``: any monotonic clock.

    Tell it what was sent, what came back, and the time.
    """

    silent_s: float
    """Without feedback for so long something is wrong."""
    round_trip_s: float | None = None
    """The last one that was reported."""
    trains_bps: float | None = None
    """How fast packets that left together came through lately: about what the narrowest link takes."""
    paused_until_s = -math.inf
    """Send nothing before: what is sent now waits behind a queue."""
    usual_s = 0.0
    """How long packets wait on this path whatever is sent."""
    is_queued = False
    """A queue stands. One report of it may as well be a busy processor, or a packet that radio held up."""

    def __init__(self, min_bps: int, max_bps: int, now_s: float, start_bps: float) -> None:
        self._sent: deque[tuple[float, int]] = deque()
        self._heard_at_s = self._sent_at_s = now_s
        self._congested: tuple[float, float] | None = None
        """When it was last more than the path takes, and what that takes."""
        self._data_bps = 0.0
        self._budget_bps = start_bps
        self.limit(min_bps, max_bps)

    @property
    def budget_bps(self) -> int:
        """What all streams and ordinary data may send together."""
        return round(self._budget_bps)

    def most_bps(self, now_s: float) -> float:
        """What may be sent altogether, with copies. Without arrival times none: more is not known to fit."""
        return self._budget_bps

    def is_limited(self, now_s: float) -> bool:
        """The path takes no more than is sent."""
        return False

    def sent_bps(self, now_s: float) -> float:
        """What was sent during the last second, with what was sent again, and data."""
        forget(self._sent, now_s)
        return sum(size for _, size in self._sent) * 8 / _WINDOW_S + self._data_bps

    def limit(self, min_bps: int, max_bps: int) -> None:
        """The streams changed: other limits hold."""
        self._min_bps, self._max_bps = min_bps, max(min_bps, max_bps)
        self._set(self._budget_bps)

    def carries(self, data_bps: float, now_s: float) -> None:
        """So much ordinary data is on the path besides. Where nothing but the streams' own limit bounded the budget,
        that makes room for it."""
        is_at_most = self._budget_bps >= self._max_bps + self._data_bps and not self.is_limited(now_s)
        more_bps, self._data_bps = data_bps - self._data_bps, data_bps
        self._set(self._budget_bps + more_bps if is_at_most else self._budget_bps)

    def sent(self, size_bytes: int, now_s: float, *, is_key: bool = False) -> None:
        """Something was sent; ``is_key``: of a key frame."""
        if now_s - self._sent_at_s >= self.silent_s:
            self._heard_at_s = now_s  # nobody reports what was not sent
        self._sent_at_s = now_s
        self._sent.append((now_s, size_bytes))
        forget(self._sent, now_s)

    @abstractmethod
    def handle(self, feedback: Feedback, now_s: float) -> None:
        """Something came back from the viewer."""

    @abstractmethod
    def tick(self, now_s: float) -> None:
        """Call it about twice per second: silence is news too."""

    def _set(self, budget_bps: float) -> None:
        self._budget_bps = min(self._max_bps + self._data_bps, max(self._min_bps + self._data_bps, budget_bps))


def forget(events: deque[tuple[float, int]], now_s: float) -> None:
    """Drop those of before the last second."""
    while events and events[0][0] <= now_s - _WINDOW_S:
        events.popleft()
