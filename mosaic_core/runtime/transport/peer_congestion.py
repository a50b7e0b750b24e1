"""Congestion control of one operator's peer connection: all of its cameras and sounds share one estimate of the path,
one budget and one pacer.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Hashable

from mosaic_core.machines.congestion.arrival_report import ArrivalReport
from mosaic_core.machines.congestion.background_rate import BackgroundRate
from mosaic_core.machines.congestion.budget_allocator import Demand
from mosaic_core.machines.congestion.connection_budget import ConnectionBudget
from mosaic_core.machines.congestion.feedback import Feedback
from mosaic_core.runtime.timing.deadline_timer import DeadlineTimer


class PeerCongestion:
    """Drives the :class:`ConnectionBudget` of one operator, and tells its streams when their parts change. Event loop
    only."""

    def __init__(self) -> None:
        self._budget = ConnectionBudget(time.monotonic())
        self._changed: dict[Hashable, Callable[[], None]] = {}
        self._pause = DeadlineTimer(self._tell)
        self._told: dict[Hashable, int] = {}

    @property
    def background(self) -> BackgroundRate:
        """Of what gives way to the streams, on whichever peer connection it is sent."""
        return self._budget.background

    # -- streams -------------------------------------------------------------------------------------------------

    def want(
        self, stream: Hashable, demand: Demand, changed: Callable[[], None], ceiling_bps: int | None = None
    ) -> None:
        """See :meth:`ConnectionBudget.want`. ``changed`` is called when its part did, and when a pause begins or
        ends."""
        self._changed[stream] = changed
        self._budget.want(stream, demand, ceiling_bps)
        self._told[stream] = self._budget.part_bps(stream)
        self._tell_if_changed()

    def want_nothing(self, stream: Hashable) -> None:
        self._changed.pop(stream, None)
        self._told.pop(stream, None)
        self._budget.want_nothing(stream)
        if not self._changed:
            self._pause.cancel()
        self._tell_if_changed()

    def part_bps(self, stream: Hashable) -> int:
        return self._budget.part_bps(stream)

    def picture_bps(self, stream: Hashable) -> int:
        return self._budget.picture_bps(stream, time.monotonic())

    def may_rise(self) -> bool:
        """See :meth:`ConnectionBudget.may_rise`."""
        return self._budget.may_rise(time.monotonic())

    # -- sending -------------------------------------------------------------------------------------------------

    @property
    def is_paused(self) -> bool:
        """What is sent now waits behind a queue."""
        return time.monotonic() < self._budget.paused_until_s

    async def turn(self, waiting: int) -> None:
        """Wait until a packet may leave. Streams take turns, so that their pictures interleave."""
        wait_s = self._budget.pace(0, waiting, time.monotonic())
        while wait_s > 0.0:
            await asyncio.sleep(wait_s)
            wait_s = self._budget.pace(0, waiting, time.monotonic())

    async def paced(self, size_bytes: int, waiting: int) -> None:
        """A packet of a picture has left: wait until the next one may."""
        wait_s = self._budget.pace(size_bytes, waiting, time.monotonic())
        if wait_s > 0.0:
            await asyncio.sleep(wait_s)
            await self.turn(waiting)

    def sent(self, size_bytes: int, *, is_key: bool = False) -> None:
        self._budget.sent(size_bytes, time.monotonic(), is_key=is_key)

    def data_left(self, size_bytes: int) -> None:
        """See :meth:`ConnectionBudget.data_left`."""
        self._budget.data_left(size_bytes, time.monotonic())

    def packet_left(self, number: int, size_bytes: int) -> None:
        self._budget.packet_left(number, size_bytes, time.monotonic())

    def wants_copy(self, size_bytes: int) -> bool:
        return self._budget.wants_copy(size_bytes, time.monotonic())

    @property
    def doubles_repeats(self) -> bool:
        return self._budget.doubles_repeats

    @property
    def round_trip_s(self) -> float | None:
        return self._budget.round_trip_s

    # -- what comes back -----------------------------------------------------------------------------------------

    def reported(self, report: ArrivalReport) -> None:
        """Arrivals of packets of any stream."""
        seen = self._budget.seen(report, time.monotonic())
        if seen is not None and self._changed:
            self.handle(None, seen)

    def handle(self, stream: Hashable, feedback: Feedback) -> None:
        """What else comes back for one stream."""
        was_paused = self.is_paused
        self._budget.handle(stream, feedback, time.monotonic())
        if self.is_paused:
            self._pause.set(self._budget.paused_until_s)
        if self.is_paused != was_paused:
            self._tell()
        else:
            self._tell_if_changed()

    def tick(self) -> None:
        """Any stream, about twice per second."""
        self._budget.tick(time.monotonic())
        self._tell_if_changed()

    def _tell_if_changed(self) -> None:
        if self._budget.parts != self._told:
            self._tell()

    def _tell(self) -> None:
        self._told = self._budget.parts
        for changed in tuple(self._changed.values()):
            changed()
