"""Slows down guessing of passwords: limits on *failed* attempts in sliding windows, counted three ways.

Per e-mail and address, so that a stranger's failures stop the stranger and not the owner. Per address, against one
machine that tries many e-mails. Per e-mail from everywhere, far higher than one address can reach, against many
machines; an address from which the account logged in before is exempt, so that they can't lock its owner out.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

from mosaic_server.security.address_prefix import counted_address


@dataclass(frozen=True, slots=True)
class Limit:
    """So many failures in a window."""

    failures: int
    window_s: float


PER_EMAIL_AND_ADDRESS = Limit(8, 300.0)
PER_ADDRESS = Limit(30, 300.0)
"""Many people may share one address behind NAT."""
PER_EMAIL = Limit(200, 3600.0)
"""Twice what one address can do in an hour at eight per five minutes."""
_MAX_KEYS = 20_000
FAMILIAR_S = 30 * 24 * 3600.0
"""How long an address from which an account logged in is known as its owner's."""

_Key = tuple[str, ...]


class LoginLimits:
    """Counts failed log-ins and says how long to wait. Pure: ``now_s`` is the caller's monotonic clock. One thread (the
    event loop).

    Addresses are those that the socket tells; IPv6 counts per /64.
    """

    def __init__(self) -> None:
        self._failures: dict[_Key, deque[float]] = {}
        self._familiar: dict[_Key, float] = {}

    def wait_s(self, email: str | None, address: str, now_s: float) -> float:
        """0 if an attempt is allowed now, else seconds until it is. ``email=None``: the attempt names nobody."""
        is_familiar = email is not None and self._is_familiar(email, address, now_s)
        keys = _keys(email, address)
        return max(self._wait(key, limit, now_s) for key, limit in keys if not (is_familiar and limit is PER_EMAIL))

    def failed(self, email: str | None, address: str, now_s: float) -> None:
        for key, limit in _keys(email, address):
            self._failures.setdefault(key, deque(maxlen=limit.failures)).append(now_s)
        if len(self._failures) > _MAX_KEYS:
            self._drop_old(now_s)

    def succeeded(self, email: str, address: str, now_s: float) -> None:
        """The right password clears what this address failed at this e-mail; it may be guessing others still."""
        place = (email, counted_address(address))
        self._failures.pop(("pair", *place), None)
        self._familiar.pop(place, None)  # to the end of the line: the oldest go first
        self._familiar[place] = now_s
        if len(self._familiar) > _MAX_KEYS:
            del self._familiar[next(iter(self._familiar))]

    def _is_familiar(self, email: str, address: str, now_s: float) -> bool:
        seen_s = self._familiar.get((email, counted_address(address)))
        return seen_s is not None and now_s - seen_s < FAMILIAR_S

    def _wait(self, key: _Key, limit: Limit, now_s: float) -> float:
        times = self._failures.get(key, ())
        recent = [at_s for at_s in times if at_s > now_s - limit.window_s]
        return recent[0] + limit.window_s - now_s if len(recent) >= limit.failures else 0.0

    def _drop_old(self, now_s: float) -> None:
        old = [key for key, times in self._failures.items() if times[-1] <= now_s - PER_EMAIL.window_s]
        for key in old or list(self._failures)[: _MAX_KEYS // 10]:
            del self._failures[key]


def _keys(email: str | None, address: str) -> Iterator[tuple[_Key, Limit]]:
    counted = counted_address(address)
    yield ("address", counted), PER_ADDRESS
    if email is not None:
        yield ("pair", email, counted), PER_EMAIL_AND_ADDRESS
        yield ("email", email), PER_EMAIL
