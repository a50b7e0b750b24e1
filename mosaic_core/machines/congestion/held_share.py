"""Holds a share of the link against flows that fill its queue until it overflows, as loss-based TCP does (RFC 9438).

Making way for those gains nothing: they take what is left to them, and the queue stays. So a queue that has stood for
seconds while little was sent is theirs, and a share is held. Now and then it is let go: where the queue drains then,
the others make way too, and nothing is held any more. Losing much says that too many hold on.
"""

from __future__ import annotations

import math

from mosaic_core.machines.congestion.path_watch import PathSeen

QUEUE_S, DRAINED_S = 0.1, 0.05
"""Where all packets of a report waited so long, a queue stands; it has drained when one waited less than this."""
STANDS_S = 4.0
"""Whoever makes way has done so by then."""
_LITTLE = 0.25
"""Of the link: who sends more has not made way itself."""
SHARE = 0.4
"""Of the link. With the times in which it is let go that is a third."""
HOLDS_S, LETS_GO_S = 25.0, 3.0
_MUCH_LOST, _LESS, _LOSS_OVER_S = 0.1, 0.7, 4.0
"""A TCP that fills the queue costs a few percent."""


class HeldShare:
    """Computes the rate below which one connection doesn't fall while others keep the queue full. ``now_s``: any
    monotonic clock."""

    def __init__(self, now_s: float) -> None:
        self._theirs_since_s = now_s
        self._held_since_s: float | None = None
        self._share, self._link_bps = SHARE, 0.0
        self._loss, self._seen_at_s, self._shrunk_at_s = 0.0, now_s, now_s

    @property
    def is_held(self) -> bool:
        return self._held_since_s is not None

    def reported(self, seen: PathSeen, budget_bps: float, now_s: float) -> None:
        """``budget_bps``: what is allowed at present."""
        self._link_bps = seen.trains_bps or self._link_bps
        self._note_loss(seen, now_s)
        if seen.waited_s < (DRAINED_S if self.is_held else QUEUE_S):
            self._theirs_since_s, self._held_since_s, self._share = now_s, None, SHARE
        elif budget_bps >= _LITTLE * self._link_bps and not self.is_held:
            self._theirs_since_s = now_s  # a queue that we made ourselves may stand, or drain slowly
        elif not self.is_held and now_s - self._theirs_since_s > STANDS_S:
            self._held_since_s = now_s

    def least_bps(self, now_s: float) -> float:
        """0: nothing is held."""
        if self._held_since_s is None or (now_s - self._held_since_s) % (HOLDS_S + LETS_GO_S) > HOLDS_S:
            return 0.0
        return self._share * self._link_bps

    def _note_loss(self, seen: PathSeen, now_s: float) -> None:
        weight = 1.0 - math.exp((self._seen_at_s - now_s) / _LOSS_OVER_S)
        self._seen_at_s = now_s
        self._loss += (seen.lost / (seen.lost + seen.received) - self._loss) * weight
        if self._loss > _MUCH_LOST and now_s - self._shrunk_at_s > _LOSS_OVER_S:
            self._share, self._shrunk_at_s = _LESS * self._share, now_s
