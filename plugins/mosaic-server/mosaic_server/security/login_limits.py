"""Slows down guessing of passwords: a limit per e-mail and per address on *failed* attempts in a sliding window."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

WINDOW_S = 300.0
FAILURES_PER_EMAIL = 8
FAILURES_PER_ADDRESS = 30
"""Many people may share one address behind NAT."""
_MAX_KEYS = 20_000


class LoginLimits:
    """Pure: ``now_s`` is the caller's monotonic clock. One thread (the event loop)."""

    def __init__(self) -> None:
        self._failures: dict[str, deque[float]] = {}

    def wait_s(self, email: str | None, address: str, now_s: float) -> float:
        """0 if an attempt is allowed now, else seconds until it is. ``email=None``: the attempt names nobody."""
        return max(self._wait(key, limit, now_s) for key, limit in _keys(email, address))

    def failed(self, email: str | None, address: str, now_s: float) -> None:
        for key, limit in _keys(email, address):
            times = self._failures.setdefault(key, deque(maxlen=limit))
            times.append(now_s)
        if len(self._failures) > _MAX_KEYS:
            self._drop_old(now_s)

    def succeeded(self, email: str, address: str) -> None:
        """The right password clears the e-mail; the address may be guessing others still."""
        self._failures.pop(f"email:{email}", None)

    def _wait(self, key: str, limit: int, now_s: float) -> float:
        times = self._failures.get(key, ())
        recent = [at_s for at_s in times if at_s > now_s - WINDOW_S]
        return recent[0] + WINDOW_S - now_s if len(recent) >= limit else 0.0

    def _drop_old(self, now_s: float) -> None:
        old = [key for key, times in self._failures.items() if times[-1] <= now_s - WINDOW_S]
        for key in old or list(self._failures)[: _MAX_KEYS // 10]:
            del self._failures[key]


def _keys(email: str | None, address: str) -> Iterable[tuple[str, int]]:
    by_address = (f"address:{address}", FAILURES_PER_ADDRESS)
    return (by_address,) if email is None else ((f"email:{email}", FAILURES_PER_EMAIL), by_address)
