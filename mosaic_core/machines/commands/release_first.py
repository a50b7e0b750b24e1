"""Whoever sends on through a stop must let go before a command of theirs moves anything again: once send a zero, or
nothing at all for as long as the time-out. So a policy that goes on sending, or a key that is still held, does not move
the robot by itself when the stop is cleared.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from mosaic_core.machines.delivery.framing import SEQ_MODULUS

PAUSE_S = 1.0
"""The pause that counts where a receiver has no time-out."""
OPENING_S = 2.0
"""A sender may learn so late that its channel is open: what it sends then at once, it would have sent before."""
MAX_HOLDING = 4096
"""Sessions that are remembered: whoever comes again and again under new ones shall not fill our memory. Those that came
first are forgotten first."""


class ReleaseFirst:
    """Remembers which operators of one receiver must let go of their controls before they may move it again. ``key``:
    of a session, which survives its connections."""

    def __init__(self) -> None:
        self._holding: dict[str, None] = {}

    def stopped(self, keys: Iterable[str]) -> None:
        """A stop came: these may have commands under way."""
        for key in keys:
            self.joined(key)

    def joined(self, key: str) -> None:
        """Somebody came while it was stopped, or came back."""
        self._holding.pop(key, None)
        self._holding[key] = None
        if len(self._holding) > MAX_HOLDING:
            del self._holding[next(iter(self._holding))]

    def is_holding(self, key: str) -> bool:
        return key in self._holding

    def let_go(self, key: str) -> None:
        """It sent a zero, or paused, after the stop was cleared."""
        self._holding.pop(key, None)


class CommandPauses:
    """Tells how long the sender of one channel has paused. Only where no number is missing is a silence a pause: what
    the link lost was sent. Nor is what the link held up: by the sender's own stamps nothing was silent then."""

    def __init__(self, opened_s: float) -> None:
        self._last_s = opened_s + OPENING_S
        self._last_seq: int | None = None
        self._last_stamp_us = 0

    def arrived(self, seq: int | None, now_s: float, stamp_us: int = 0) -> float:
        """The pause before this message, which may be refused for another reason; ``seq`` ``None``: it has no frame.
        ``stamp_us``: when it was made, by the sender's clock; 0: unknown."""
        before_s, before, before_us = self._last_s, self._last_seq, self._last_stamp_us
        self._last_s, self._last_seq, self._last_stamp_us = now_s, seq, stamp_us
        if seq is not None and before is not None and (seq - before) % SEQ_MODULUS != 1:
            return 0.0
        made_s = (stamp_us - before_us) / 1e6 if stamp_us and before_us else math.inf
        return max(0.0, min(now_s - before_s, made_s))
