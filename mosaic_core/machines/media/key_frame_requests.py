"""Decides when to make a key frame: wishes of all viewers are merged, and a token bucket keeps them rare.

A key frame costs as much as ten other pictures. Under loss every viewer asks again and again; answering each wish
would cause more loss. No wish is forgotten: one that comes too soon is granted when its time has come.
"""

from __future__ import annotations

MIN_INTERVAL_S = 0.25
"""Shorter than this, two wishes are about the same picture: one key frame has not even arrived."""
BURST = 3
"""Key frames in quick succession: operators who join one after the other all get theirs at once."""
REFILL_S = 1.0
"""Then one per so many seconds."""
_TOLERANCE_S = 1e-6
"""Of adding up fractions of tokens."""


class KeyFrameRequests:
    """Merges the wishes for key frames of one encoder. ``now_s`` is any monotonic clock."""

    def __init__(self) -> None:
        self._tokens = float(BURST)
        self._counted_at_s: float | None = None
        self._made_at_s: float | None = None
        self.is_pending = False

    def ask(self) -> None:
        """Somebody needs a key frame."""
        self.is_pending = True

    def take(self, now_s: float) -> bool:
        """Whether the picture about to be encoded becomes a key frame because somebody asked."""
        if not self.is_pending or self.wait_s(now_s) > _TOLERANCE_S:
            return False
        self.made(now_s)
        return True

    def made(self, now_s: float) -> None:
        """A key frame was made, asked for or not; it serves everybody."""
        self._refill(now_s)
        self._tokens = max(0.0, self._tokens - 1.0)
        self._made_at_s = now_s
        self.is_pending = False

    def wait_s(self, now_s: float) -> float:
        """Seconds until a wish may be granted."""
        self._refill(now_s)
        spacing_s = 0.0 if self._made_at_s is None else self._made_at_s + MIN_INTERVAL_S - now_s
        return max(0.0, spacing_s, (1.0 - self._tokens) * REFILL_S)

    def _refill(self, now_s: float) -> None:
        if self._counted_at_s is not None:
            self._tokens = min(float(BURST), self._tokens + max(0.0, now_s - self._counted_at_s) / REFILL_S)
        self._counted_at_s = now_s
