"""How much of the narrowest link of a path is left to one stream by others that share it.

Trains of packets tell how fast that link is, not what others leave of it; a congestion does. That is remembered, and
more is tried gently at first, then boldly: others may have ended.
"""

from __future__ import annotations

_KEPT_S = 20.0
"""By who has all of it; half as long by who has half. Who has less tries first, and so shares become equal."""
_TRIED = 0.001
"""Of the link, per square second. Others who are still there are met at about a hundredth of the link per second, which
makes a short queue; if they ended, it is all ours within about half a minute of the last congestion."""


class PathShare:
    """Estimates the share of the path that one stream has."""

    def __init__(self) -> None:
        self._left = 1.0
        self._seen_at_s = 0.0

    def congested(self, left: float, now_s: float) -> None:
        """A queue stood, and so much of the link was left to us."""
        self._left, self._seen_at_s = left, now_s

    def at(self, now_s: float) -> float:
        """Of the link's speed, at most 1."""
        tried_s = max(0.0, now_s - self._seen_at_s - _KEPT_S * self._left)
        return min(1.0, self._left + _TRIED * tried_s**2)
