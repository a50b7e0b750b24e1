"""Logs the arrival of single packets for a receiver: notes the number of each, and reports, some times per second, all
that came and all that is missing before them.
"""

from __future__ import annotations

from dataclasses import dataclass

from mosaic_core.machines.congestion.arrival_report import NUMBERS, TICK_S, ArrivalReport

MOST_NUMBERS = 2048
"""Of one report, and of what is told to be missing: what was sent before a longer gap, nobody waits for any more."""
MOST_ARRIVALS = 256
"""Of one report, so that it fits into a datagram."""
_MOST_TICKS = (1 << 15) - 1
"""Between two arrivals of one report: their difference has 16 bits and a sign."""


@dataclass(slots=True)
class _Report:
    """A report of arrivals that is being made: from number ``first``, counted without end, to an arrival."""

    first: int
    ticks: list[int | None]
    arrivals: int = 0
    newest_ticks: int = 0

    @property
    def end(self) -> int:
        return self.first + len(self.ticks)

    def may_add(self, first: int, number: int, ticks: int) -> bool:
        return (
            first == self.end
            and number - self.first < MOST_NUMBERS
            and self.arrivals < MOST_ARRIVALS
            and abs(ticks - self.newest_ticks) <= _MOST_TICKS
        )

    def add(self, number: int, ticks: int) -> None:
        self.ticks += [*[None] * (number - self.end), ticks]
        self.arrivals += 1
        self.newest_ticks = ticks

    def finished(self) -> ArrivalReport:
        arrivals = tuple(None if one is None else one * TICK_S for one in self.ticks)
        return ArrivalReport(self.first % NUMBERS, arrivals)


class ArrivalLog:
    """Notes the packets that arrive on one connection."""

    def __init__(self) -> None:
        self._arrived: dict[int, int] = {}
        self._newest: int | None = None
        self._next: int | None = None

    def note(self, number: int, now_s: float) -> None:
        """A packet came with ``number``, modulo 2^16. Of two with the same one the first counts."""
        if self._newest is None:
            self._newest = number
        ahead = (number - self._newest + NUMBERS // 2) % NUMBERS - NUMBERS // 2
        self._arrived.setdefault(self._newest + ahead, round(now_s / TICK_S))
        self._newest += max(0, ahead)

    def take(self) -> list[ArrivalReport]:
        """What came since the last time, in order. What was told to be missing and still comes is told by itself."""
        reports: list[_Report] = []
        for number in sorted(self._arrived):
            first = self._told_from(number)
            ticks = self._arrived[number]
            if not reports or not reports[-1].may_add(first, number, ticks):
                reports.append(_Report(first, []))
            reports[-1].add(number, ticks)
            self._next = max(number + 1, self._next or number + 1)
        self._arrived.clear()
        return [report.finished() for report in reports]

    def _told_from(self, number: int) -> int:
        """Together with ``number`` are told those before it of which nothing was told yet."""
        if self._next is None or not 0 <= number - self._next < MOST_NUMBERS:
            return number
        return self._next
