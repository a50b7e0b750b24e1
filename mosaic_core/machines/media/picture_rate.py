"""Pictures per second of a source, from the times of its pictures: what rate controls that count pictures must know."""

from __future__ import annotations

from collections import deque

_INTERVALS = 9
"""Their median: neither a left-out picture nor a hiccup of a driver moves it."""
_ENOUGH = 5
_SLOWEST_S = 2.0
"""A longer gap is a pause, not a rate."""


class PictureRate:
    """``fps`` is ``None`` until a few pictures were seen. One thread calls :meth:`seen`, any may read ``fps``."""

    def __init__(self) -> None:
        self._intervals: deque[float] = deque(maxlen=_INTERVALS)
        self._last_s: float | None = None
        self.fps: float | None = None

    def seen(self, at_s: float) -> None:
        """A picture of this time; times that do not rise are ignored."""
        last_s, self._last_s = self._last_s, at_s
        if last_s is None or not 0.0 < at_s - last_s <= _SLOWEST_S:
            return
        self._intervals.append(at_s - last_s)
        if len(self._intervals) >= _ENOUGH:
            self.fps = 1.0 / sorted(self._intervals)[len(self._intervals) // 2]
