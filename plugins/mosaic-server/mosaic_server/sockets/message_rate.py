"""How much one socket may say: a token bucket over messages, larger ones costing more. Pure."""

from __future__ import annotations

MESSAGES_PER_S = 50.0
BURST = 500.0
"""A page that opens several robots at once sends some hundred candidates within a second."""
_BYTES_PER_TOKEN = 16 * 1024


class MessageRate:
    """A bucket that refills with time. ``now_s`` is the caller's monotonic clock."""

    def __init__(self, now_s: float, *, per_s: float = MESSAGES_PER_S, burst: float = BURST) -> None:
        self._per_s = per_s
        self._burst = burst
        self._tokens = burst
        self._at_s = now_s

    def allows(self, size_bytes: int, now_s: float) -> bool:
        """Whether a message of this size is within the rate; it is paid for if it is."""
        self._tokens = min(self._burst, self._tokens + (now_s - self._at_s) * self._per_s)
        self._at_s = now_s
        cost = 1 + size_bytes / _BYTES_PER_TOKEN
        if cost > self._tokens:
            return False
        self._tokens -= cost
        return True
