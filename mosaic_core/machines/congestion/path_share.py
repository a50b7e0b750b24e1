"""Estimates our share of the narrowest link of a path: as fast as that was seen to be, less what others take of it.

Trains of packets tell how fast the link is, but not what others leave of it; a congestion does. That is remembered, and
more is tried gently at first, then boldly: others may have ended. Where a shaper lets short trains through at once, the
second congestion at the same speed gives it away, and from then on the speed is remembered in the same way.
"""

from __future__ import annotations

import math

_KEPT_S = 20.0
"""By who has all of it; half as long by who has half. Who has less tries first, and so shares become equal."""
_TRIED = 0.001
"""Of the link, per square second. What takes no more is met at about a hundredth of the link per second, which makes a
short queue; otherwise twice as much is ours within about half a minute of the last congestion."""
_SAME = 1.33
"""Speeds that differ by less are of the same link."""
_TOO_FAST, _TRAINS_AGE_S = 1.5, 1.0
"""Trains promised so much more than the link takes, most of them sent after the congestion before."""


class PathShare:
    """Estimates the speed of the link and the share of it that one connection has."""

    def __init__(self) -> None:
        self._link_bps = math.inf
        self._left = 1.0
        self._seen_at_s = math.inf  # not yet
        self._promised_bps = 0.0
        self._is_shaped = False

    def trains_came(self, trains_bps: float, now_s: float) -> None:
        """Single pictures come through at this speed lately."""
        if now_s - self._seen_at_s > _TRAINS_AGE_S:
            self._promised_bps = max(self._promised_bps, trains_bps)

    def congested(self, path_bps: float, left: float | None, now_s: float) -> None:
        """A queue stood: ``path_bps`` of ours came through, and ``left`` of the link was left to us (``None``: not
        known)."""
        self._left = self._left if left is None else left
        before_bps, self._link_bps = self._link_bps, path_bps / max(1e-3, self._left)
        if not 1 / _SAME < self._link_bps / before_bps < _SAME:
            self._is_shaped = False
        elif self._promised_bps > _TOO_FAST * self._link_bps:
            self._is_shaped = True
        self._seen_at_s, self._promised_bps = now_s, 0.0

    def bps(self, trains_bps: float, now_s: float) -> float:
        """What is ours, if single pictures come through at ``trains_bps``."""
        tried_s = max(0.0, now_s - self._seen_at_s - _KEPT_S * self._left)
        tried = _TRIED * tried_s**2
        if self._is_shaped:
            trains_bps = min(trains_bps, (1.0 + tried) * self._link_bps)
        return min(1.0, self._left + tried) * trains_bps
