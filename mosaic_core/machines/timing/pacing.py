"""Paces what comes too often: a token bucket, two ways of thinning, complaints, a share of the loop's time, and what
measures how often pictures come. All of them take any monotonic clock and know none.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Hashable
from typing import Generic, TypeVar

T = TypeVar("T")

BURST_S = 0.25
"""What a network held back for this long may arrive at once (FIELD-NOTES: Wi-Fi roaming and LTE stalls)."""
COMPLAINT_PERIOD_S = 60.0
_INTERVALS = 9
"""Their median: neither a left-out picture nor a hiccup of a driver moves it."""
_ENOUGH = 5
_SLOWEST_S = 2.0
"""A longer gap is a pause, not a rate."""


class TokenBucket:
    """Admits ``per_s`` things a second, and as many as ``burst`` at once; what is refused costs nothing."""

    def __init__(self, per_s: float, burst: float) -> None:
        self._per_s = _positive(per_s)
        self._burst = burst
        self._tokens = burst
        self._at_s: float | None = None

    @classmethod
    def of_rate(cls, rate_hz: float) -> TokenBucket:
        """A bucket deep enough for what a jittery network delivers at once."""
        return cls(rate_hz, max(2.0, rate_hz * BURST_S))

    def admits(self, now_s: float, tokens: float = 1.0) -> bool:
        """Whether something that costs ``tokens`` may pass now; if so, it has paid."""
        if self._at_s is None:
            self._at_s = now_s
        elif now_s > self._at_s:
            self._tokens = min(self._burst, self._tokens + (now_s - self._at_s) * self._per_s)
            self._at_s = now_s
        if self._tokens < tokens:
            return False
        self._tokens -= tokens
        return True


class NewestThinning(Generic[T]):
    """Lets out at most ``max_rate_hz`` values a second: within a period the newest is kept, and goes out when the
    period is over, so that the last value of a burst always arrives. ``thinned`` counts those left out."""

    def __init__(self, max_rate_hz: float) -> None:
        self._period_s = 1.0 / _positive(max_rate_hz)
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
        """A timer that is a little late must not lower the rate."""
        self._next_at_s = _next_on_grid(self._next_at_s, self._period_s, now_s)


class GridThinning:
    """Takes at most ``rate_hz`` of a faster source's pictures a second, evenly, and none of the others later.

    ``slack``: share of a period by which one may come early: a 30 fps camera that jitters still gives 30 fps, not 15.
    """

    def __init__(self, rate_hz: float, slack: float = 0.25) -> None:
        self._period_s = 1.0 / _positive(rate_hz)
        self._early_s = self._period_s * slack
        self._due_s = float("-inf")

    def takes(self, at_s: float) -> bool:
        """Whether the picture of time ``at_s`` is taken; times rise from call to call."""
        if at_s < self._due_s - self._early_s:
            return False
        self._due_s = _next_on_grid(self._due_s, self._period_s, at_s)
        return True


class ComplaintPace:
    """Says whether a complaint is due: what goes wrong a thousand times a second is worth a line in the log once, and
    again while it goes on. Not thread-safe; remembers every key that it is asked about."""

    def __init__(self, period_s: float = COMPLAINT_PERIOD_S) -> None:
        self._period_s = period_s
        self._said_at_s: dict[Hashable, float] = {}

    def is_due(self, key: Hashable, now_s: float) -> bool:
        """The first time, and once the period is over since it was due last."""
        said_at_s = self._said_at_s.get(key)
        if said_at_s is not None and now_s - said_at_s < self._period_s:
            return False
        self._said_at_s[key] = now_s
        return True


class TimeShare:
    """Keeps one kind of work to its ``share`` (0 to 1) of an event loop's time: what it took is paid back by waiting,
    but for ``credit_s``. This is the virtual scheduling of ITU-T I.371 (GCRA) with time in place of cells."""

    def __init__(self, share: float, credit_s: float) -> None:
        self._share = share
        self._credit_s = credit_s
        self._paid_back_at_s = float("-inf")

    def wait_s(self, now_s: float) -> float:
        """How long to wait before more of the work; 0: go on."""
        return max(0.0, self._paid_back_at_s - self._credit_s - now_s)

    def took(self, began_s: float, ended_s: float) -> None:
        """So long the work kept the loop."""
        self._paid_back_at_s = max(self._paid_back_at_s, began_s) + (ended_s - began_s) / self._share


class PictureRate:
    """Measures a source's pictures per second by their times, which rate controls that count pictures must know.

    ``fps`` is ``None`` until a few were seen. One thread calls :meth:`seen`, any may read ``fps``.
    """

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


def _positive(rate_hz: float) -> float:
    if not rate_hz > 0:  # nor NaN
        raise ValueError("a rate must be positive")
    return rate_hz


def _next_on_grid(due_s: float, period_s: float, now_s: float) -> float:
    """One period after ``due_s``; where a whole period was missed, after now: the grid goes on without a burst."""
    following_s = due_s + period_s
    return following_s if following_s > now_s else now_s + period_s
