"""Which rung one viewer's budget affords: down at once, up one rung at a time and only when it lasts.

Moving up costs a key frame and sends more: if the link did not take it, the next attempt waits longer each time.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from mosaic_core.machines.media.rung_ladder import Rung

STEADY_S = 1.0
"""The budget must afford the better rung for so long."""
FIRST_HOLD_S, LONGEST_HOLD_S = 8.0, 60.0
FAILED_WITHIN_S = 6.0
"""Down again within this time after a move up: the move was the mistake."""


class RungChoice:
    """Chooses one viewer's rung of a ladder (best rung first). ``may_rise`` is asked before a move up: others on the
    same link may just have moved."""

    def __init__(
        self, rungs: Sequence[Rung], budget_bps: int, now_s: float, may_rise: Callable[[], bool] = lambda: True
    ) -> None:
        self._may_rise = may_rise
        self._rungs = tuple(rungs)
        self._index = self._affordable(budget_bps)
        self._enough_since_s: float | None = None
        self._moved_up_at_s: float | None = None
        self._hold_until_s = now_s
        self._hold_s = FIRST_HOLD_S

    @property
    def index(self) -> int:
        """Into the ladder; 0 is the best rung."""
        return self._index

    def stand_on(self, rungs: Sequence[Rung], index: int) -> None:
        """The ladder changed, and the rung of before is at ``index`` now. What was learned of the link stays."""
        self._rungs = tuple(rungs)
        self._index = index

    def decide(self, budget_bps: int, now_s: float) -> int:
        """The rung for this budget now."""
        if budget_bps < self._rungs[self._index].floor_bps:
            self._move_down(budget_bps, now_s)
        elif self._index > 0 and budget_bps >= self._needed_above():
            self._consider_up(now_s)
        else:
            self._enough_since_s = None
        return self._index

    def _move_down(self, budget_bps: int, now_s: float) -> None:
        before = self._index
        self._index = max(before, self._affordable(budget_bps))
        self._enough_since_s = None
        if self._index == before:
            return  # the last rung: there is nothing cheaper
        has_failed = self._moved_up_at_s is not None and now_s - self._moved_up_at_s <= FAILED_WITHIN_S
        self._hold_s = min(LONGEST_HOLD_S, self._hold_s * 2) if has_failed else FIRST_HOLD_S
        self._hold_until_s = now_s + self._hold_s
        self._moved_up_at_s = None

    def _consider_up(self, now_s: float) -> None:
        if self._enough_since_s is None:
            self._enough_since_s = now_s
        is_time = now_s - self._enough_since_s >= STEADY_S and now_s >= self._hold_until_s
        if is_time and self._may_rise():
            self._index -= 1
            self._moved_up_at_s = now_s
            self._enough_since_s = None

    def _needed_above(self) -> int:
        """This rung at its best, and the better one at its least."""
        return max(self._rungs[self._index].ceiling_bps, self._rungs[self._index - 1].floor_bps)

    def _affordable(self, budget_bps: int) -> int:
        for index, rung in enumerate(self._rungs):
            if budget_bps >= rung.floor_bps:
                return index
        return len(self._rungs) - 1
