"""Pings every operator who can be measured, and tells whoever commands how its speed is being limited."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping

from mosaic_core.machines.commands.slow_down import REPORT_PERIOD_S, LimitReport
from mosaic_core.runtime.commands.link_watch import LinkWatch
from mosaic_core.runtime.control.command_desk import CommandDesk
from mosaic_core.runtime.control.control_words import safety_limit
from mosaic_core.runtime.handlers.routes import Route
from mosaic_core.runtime.timing.deadline_timer import DeadlineTimer

_TICK_S = 0.1
"""Between two pings of a peer: a single lost one makes the link look this much slower."""
_TICKS_PER_FLUSH = 5
_TICKS_PER_REPORT = round(REPORT_PERIOD_S / _TICK_S)


class LinkReports:
    """Measures operators' links and reports the limits that follow. Event loop only. Runs while somebody is there to be
    measured. ``routes``: those of now. ``commander``: whose commands a
    receiver takes.
    """

    def __init__(
        self,
        links: LinkWatch,
        routes: Callable[[], Iterable[Route]],
        commander: Callable[[Route], str | None],
        desk: CommandDesk,
    ) -> None:
        self._links = links
        self._routes = routes
        self._commander = commander
        self._desk = desk
        self._reports: dict[str, tuple[str, LimitReport]] = {}
        self._factors: dict[str, float] = {}
        self._ticks = 0
        self._timer = DeadlineTimer(self._tick)
        links.added = self._wake

    @property
    def factors(self) -> Mapping[str, float]:
        """What is left of the speed, by label, where somebody commands."""
        return self._factors

    def close(self) -> None:
        self._timer.cancel()

    def _wake(self) -> None:
        if not self._timer.is_set:
            self._ticks = -1
            self._timer.set(time.monotonic() + _TICK_S)

    def _tick(self) -> None:
        self._timer.set(time.monotonic() + _TICK_S if self._links.peer_ids else None)
        self._ticks += 1
        self._desk.ping_all()
        if self._ticks % _TICKS_PER_FLUSH == 0:
            self._desk.time_passed(time.monotonic())
        if self._ticks % _TICKS_PER_REPORT == 0:
            for route in self._routes():
                if route.safety.is_slowed:
                    self._report(route)

    def _report(self, route: Route) -> None:
        label, peer_id = route.label, self._commander(route)
        link = self._links.get(peer_id) if peer_id is not None else None
        if peer_id is None or link is None:
            self._reports.pop(label, None)
            self._factors.pop(label, None)
            return
        known_id, report = self._reports.get(label, ("", None))
        if report is None or known_id != peer_id:
            report = LimitReport()
            self._reports[label] = (peer_id, report)
        factor, causes = link.speed(route.safety.curves)
        self._factors[label] = factor
        if report.is_due(factor, causes, time.monotonic()):
            self._desk.limited(peer_id, safety_limit(label, factor, causes))
