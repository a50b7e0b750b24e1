"""One-time codes: exchanged once, within a minute, for an access token. Kept in memory only.

They travel in a URL fragment, which browsers never send to a server.
"""

from __future__ import annotations

import hashlib
import secrets
from dataclasses import dataclass

LIFETIME_S = 60.0
_MAX_OPEN = 1000


@dataclass(frozen=True, slots=True)
class OneTimeLogin:
    """Tells for whom a code was issued, and under which log-in: a changed password ends the code too."""

    account_id: str
    login_version: int


class OneTimeCodes:
    """Issues one-time codes and redeems each once. Pure: ``now_s`` is the caller's monotonic clock. One thread (the
    event loop).
    """

    def __init__(self) -> None:
        self._open: dict[str, tuple[OneTimeLogin, float]] = {}

    def issue(self, login: OneTimeLogin, now_s: float) -> str:
        self._drop_expired(now_s)
        while len(self._open) >= _MAX_OPEN:
            self._open.pop(next(iter(self._open)))
        code = secrets.token_urlsafe(24)
        self._open[_key(code)] = (login, now_s + LIFETIME_S)
        return code

    def redeem(self, code: str, now_s: float) -> OneTimeLogin | None:
        """What the code was issued for; a second time, or too late, ``None``."""
        self._drop_expired(now_s)
        found = self._open.pop(_key(code), None)
        return None if found is None else found[0]

    def _drop_expired(self, now_s: float) -> None:
        for key in [key for key, (_, until_s) in self._open.items() if until_s <= now_s]:
            del self._open[key]


def _key(code: str) -> str:
    """Looking up a hash tells nobody by timing how much of a guess was right."""
    return hashlib.sha256(code.encode()).hexdigest()
