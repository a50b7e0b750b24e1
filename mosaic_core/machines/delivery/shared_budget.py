"""A budget bounds what strangers together make us keep: who holds most gives back first, until all fits again."""

from __future__ import annotations

from collections.abc import Callable


class SharedBudget:
    """The bytes that all holdings of it may hold together."""

    def __init__(self, limit_bytes: int) -> None:
        self._limit_bytes = limit_bytes
        self._holdings: dict[Holding, None] = {}
        self.size_bytes = 0

    def grown(self, holding: Holding, more_bytes: int) -> None:
        """A holding has more than before, or less; those who hold most make room, if need be."""
        self.size_bytes += more_bytes
        if holding.size_bytes > 0:
            self._holdings[holding] = None
        else:
            self._holdings.pop(holding, None)
        while more_bytes > 0 and self.size_bytes > self._limit_bytes:
            largest = max(self._holdings, key=lambda one: one.size_bytes)
            before_bytes = largest.size_bytes
            largest.give_back()
            if largest.size_bytes >= before_bytes:
                return


class Holding:
    """The bytes that one peer holds of a shared budget. ``give_back`` makes it hold less; it is called when this one
    holds most."""

    def __init__(self, budget: SharedBudget, give_back: Callable[[], None]) -> None:
        self.give_back = give_back
        self.size_bytes = 0
        self._budget = budget

    def add(self, more_bytes: int) -> None:
        """It holds so much more, or less."""
        self.size_bytes += more_bytes
        self._budget.grown(self, more_bytes)
