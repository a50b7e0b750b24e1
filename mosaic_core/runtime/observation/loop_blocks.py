"""Counts what held up a robot's event loop, by connector."""

from __future__ import annotations

from collections import Counter

from mosaic_core.runtime.observation.counters import LoopSnapshot
from mosaic_core.runtime.threads.loop_guard import LoopBlock


class LoopBlocks:
    """The blocks of one robot since it started. Event loop only."""

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()
        self._longest_s = 0.0
        self._last: LoopBlock | None = None

    def add(self, block: LoopBlock) -> None:
        self._counts[block.label] += 1
        self._longest_s = max(self._longest_s, block.duration_s)
        self._last = block

    def snapshot(self, now_s: float) -> LoopSnapshot | None:
        last = self._last
        if last is None:
            return None
        ago_s = now_s - last.at_s
        return LoopSnapshot(dict(self._counts), self._longest_s, last.label, last.place, last.duration_s, ago_s)
