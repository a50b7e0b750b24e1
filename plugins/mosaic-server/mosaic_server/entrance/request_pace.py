"""Gives every address its turns: requests beyond the rate wait, and the loop has time for others meanwhile. Pure."""

from __future__ import annotations

_MAX_ADDRESSES = 10_000


class RequestPace:
    """Schedules the requests of each address (ITU-T I.371, GCRA): ``burst`` at once, then ``per_s`` a second.

    ``now_s`` is the caller's monotonic clock. One thread (the event loop).
    """

    def __init__(self, per_s: float, burst: float) -> None:
        self._period_s = 1.0 / per_s
        self._credit_s = burst * self._period_s
        self._paid_back_at_s: dict[str, float] = {}

    def wait_s(self, address: str, now_s: float) -> float:
        """How long this request of the address has to wait for its turn."""
        if len(self._paid_back_at_s) > _MAX_ADDRESSES:
            self._forget_settled(now_s)
        at_s = max(self._paid_back_at_s.get(address, now_s), now_s)
        self._paid_back_at_s[address] = at_s + self._period_s
        return max(0.0, at_s + self._period_s - self._credit_s - now_s)

    def left(self, address: str) -> None:
        """Its newest request was refused and needs no turn."""
        self._paid_back_at_s[address] -= self._period_s

    def _forget_settled(self, now_s: float) -> None:
        self._paid_back_at_s = {name: at_s for name, at_s in self._paid_back_at_s.items() if at_s > now_s}
