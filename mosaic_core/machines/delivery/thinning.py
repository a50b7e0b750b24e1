"""Not more than so many values a second: within a period the newest is kept, and goes out when the period is over.

So the last value of a burst always arrives, at most one period late.
"""

from __future__ import annotations

from typing import Generic, TypeVar

T = TypeVar("T")


class Thinner(Generic[T]):
    """Of one channel. Not thread-safe; ``now_s``: any monotonic clock. ``thinned`` counts the values left out."""

    def __init__(self, max_rate_hz: float) -> None:
        if not max_rate_hz > 0:  # nor NaN
            raise ValueError("a rate must be positive")
        self._period_s = 1.0 / max_rate_hz
        self._next_at_s = float("-inf")
        self._kept: T | None = None
        self.thinned = 0

    def offer(self, value: T, now_s: float) -> T | None:
        """What goes out now, if anything: ``value``, or nothing and it is kept until :attr:`due_at_s`."""
        self.thinned += self._kept is not None
        if now_s < self._next_at_s:
            self._kept = value
            return None
        self._kept = None
        self._went_out(now_s)
        return value

    @property
    def due_at_s(self) -> float | None:
        """When to ask for :meth:`due`; ``None``: nothing is kept."""
        return None if self._kept is None else self._next_at_s

    def due(self, now_s: float) -> T | None:
        """The kept value, once its time has come."""
        if self._kept is None or now_s < self._next_at_s:
            return None
        value, self._kept = self._kept, None
        self._went_out(now_s)
        return value

    def _went_out(self, now_s: float) -> None:
        """A timer that is a little late must not lower the rate: the grid goes on while no whole period is missed."""
        on_grid_s = self._next_at_s + self._period_s
        self._next_at_s = on_grid_s if on_grid_s > now_s else now_s + self._period_s
