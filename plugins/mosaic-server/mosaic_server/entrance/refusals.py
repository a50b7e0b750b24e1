"""Tells of refusals in the log: the first at once, those that follow once a minute with their number."""

from __future__ import annotations

import logging
from dataclasses import dataclass

_log = logging.getLogger(__name__)

PERIOD_S = 60.0
_MAX_KINDS = 1000
OTHERS = "other addresses"


@dataclass(slots=True)
class _RefusalKind:
    told_at_s: float
    untold: int = 0


class Refusals:
    """Counts what was refused, by reason and address. One thread (the event loop)."""

    def __init__(self) -> None:
        self._kinds: dict[tuple[str, str], _RefusalKind] = {}

    def note(self, what: str, address: str, now_s: float) -> None:
        """``what`` completes "refused …": "a connection (…)"."""
        key = (what, address)
        if key not in self._kinds and len(self._kinds) >= _MAX_KINDS:
            key = (what, OTHERS)
        kind = self._kinds.get(key)
        if kind is not None:
            kind.untold += 1
            return
        self._kinds[key] = _RefusalKind(now_s)
        _log.warning("refused %s from %s", what, key[1])

    def tick(self, now_s: float) -> None:
        """Call now and then: tells what has come together since."""
        for (what, address), kind in list(self._kinds.items()):
            if now_s - kind.told_at_s < PERIOD_S:
                continue
            if not kind.untold:
                del self._kinds[what, address]
                continue
            _log.warning("refused %s from %s, %d times more in %.0f s", what, address, kind.untold, PERIOD_S)
            kind.told_at_s, kind.untold = now_s, 0
