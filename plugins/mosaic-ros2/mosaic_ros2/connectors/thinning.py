"""Thins what comes too often, each key by itself, so that the last value of a burst always goes out."""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from typing import Generic, TypeVar

from mosaic_core.machines.timing.pacing import NewestThinning

T = TypeVar("T")

MAX_KEYS = 1024
"""Frames and parts of a robot; a stranger may send any number of names."""


class KeyedThinning(Generic[T]):
    """Lets out at most ``max_rate_hz`` values a second of each key."""

    def __init__(self, max_rate_hz: float) -> None:
        self._max_rate_hz = max_rate_hz
        self._by_key: dict[Hashable, NewestThinning[T]] = {}
        self._told = 0

    def offer(self, key: Hashable, value: T, now_s: float) -> T | None:
        """What goes out now: ``value``, or nothing and it is kept until its time has come."""
        thinning = self._by_key.get(key)
        if thinning is None:
            if len(self._by_key) >= MAX_KEYS:
                self._by_key.pop(next(iter(self._by_key)))
            thinning = self._by_key[key] = NewestThinning(self._max_rate_hz)
        return thinning.offer(value, now_s)

    def due(self, now_s: float) -> Iterator[T]:
        """The kept values whose time has come."""
        for thinning in self._by_key.values():
            value = thinning.due(now_s)
            if value is not None:
                yield value

    def take_thinned(self) -> int:
        """How many were left out since this was asked last."""
        every = sum(one.thinned for one in self._by_key.values())
        new, self._told = max(0, every - self._told), every
        return new
