"""Not more than so many commands a second: a token bucket, deep enough for what a jittery network delivers at once."""

from __future__ import annotations

BURST_S = 0.25
"""What a network held back for this long may arrive at once (FIELD-NOTES: Wi-Fi roaming and LTE stalls)."""


class RateGate:
    """The gate of one receiver and one peer. ``max_rate_hz`` ``None``: everything passes."""

    def __init__(self, max_rate_hz: float | None) -> None:
        if max_rate_hz is not None and not max_rate_hz > 0:  # nor NaN
            raise ValueError("a rate must be positive")
        self._rate_hz = max_rate_hz
        self._depth = 1.0 if max_rate_hz is None else max(2.0, max_rate_hz * BURST_S)
        self._tokens = self._depth
        self._at_s: float | None = None

    def admits(self, now_s: float) -> bool:
        """Whether a command may pass now; one that may not costs nothing."""
        if self._rate_hz is None:
            return True
        if self._at_s is not None and now_s > self._at_s:
            self._tokens = min(self._depth, self._tokens + (now_s - self._at_s) * self._rate_hz)
        self._at_s = now_s if self._at_s is None else max(self._at_s, now_s)
        if self._tokens < 1.0:
            return False
        self._tokens -= 1.0
        return True
