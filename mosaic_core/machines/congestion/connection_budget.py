"""Divides what one peer connection may send among its streams: one estimate from all that is sent, one division of
it."""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import replace

from mosaic_core.machines.congestion.arrival_report import ArrivalReport
from mosaic_core.machines.congestion.background_rate import BackgroundRate
from mosaic_core.machines.congestion.budget_allocator import Demand, allocated
from mosaic_core.machines.congestion.congestion_controller import CongestionController
from mosaic_core.machines.congestion.data_rate import DataRate
from mosaic_core.machines.congestion.feedback import BandwidthEstimate, Feedback, ReceiverReport
from mosaic_core.machines.congestion.packet_copies import PacketCopies
from mosaic_core.machines.congestion.packet_pacer import PacketPacer
from mosaic_core.machines.congestion.path_rate import PathRate
from mosaic_core.machines.congestion.path_watch import PathSeen, PathWatch
from mosaic_core.machines.congestion.rate_control import START_BPS, RateControl
from mosaic_core.machines.congestion.stream_reports import StreamReports

_MOST_FOR_DATA = 0.5
"""Of the budget: whatever data is sent, pictures make way for no more."""
RISE_INTERVAL_S = 1.0
"""Between two streams that begin a better picture: a key frame of each at the same time is a queue."""


class ConnectionBudget:
    """Estimates one connection and divides what it carries. A stream is any key; ``now_s`` any monotonic clock."""

    def __init__(self, now_s: float) -> None:
        self._rate: CongestionController = RateControl(START_BPS, START_BPS, now_s)
        self._hears_arrivals = False
        self._watch = PathWatch()
        self._reports = StreamReports()
        self._demands: dict[Hashable, Demand] = {}
        self._ceilings_bps: dict[Hashable, float] = {}
        self._parts: dict[Hashable, int] = {}
        self._copies = PacketCopies()
        self._pacer = PacketPacer()
        self._data, self._data_bps = DataRate(), 0.0
        self.background = BackgroundRate()
        """Of what gives way to the streams."""
        self._rose_at_s = now_s - RISE_INTERVAL_S

    # -- what the streams want -----------------------------------------------------------------------------------

    def want(self, stream: Hashable, demand: Demand, ceiling_bps: int | None = None) -> None:
        """It is watched, or can use another amount. ``ceiling_bps``: of it and its copies, where the user set one."""
        self._demands[stream] = demand
        self._ceilings_bps[stream] = ceiling_bps or math.inf
        self._limit()

    def want_nothing(self, stream: Hashable) -> None:
        """Nobody watches it. What is known of the path stays."""
        if self._demands.pop(stream, None) is not None:
            self._limit()

    def part_bps(self, stream: Hashable) -> int:
        """What the stream may send, repeats included; 0 unless it is wanted."""
        return self._parts.get(stream, 0)

    def picture_bps(self, stream: Hashable, now_s: float) -> int:
        """What its pictures may take, if copies have to fit in as well."""
        part_bps = self.part_bps(stream)
        is_limited = self._rate.is_limited(now_s) or 2 * part_bps > self._ceilings_bps.get(stream, math.inf)
        return self._copies.picture_bps(part_bps, is_limited=is_limited)

    def may_rise(self, now_s: float) -> bool:
        """Whether a stream may begin a better picture now, with its key frame; who may does."""
        if now_s - self._rose_at_s < RISE_INTERVAL_S:
            return False
        self._rose_at_s = now_s
        return True

    # -- what is sent --------------------------------------------------------------------------------------------

    def sent(self, size_bytes: int, now_s: float, *, is_key: bool = False) -> None:
        """A picture leaves, or a packet is repeated."""
        self._rate.sent(size_bytes, now_s, is_key=is_key)

    def data_left(self, size_bytes: int, now_s: float) -> None:
        """A packet of ordinary data, of which no report of arrivals tells; not of what gives way."""
        self._data.left(size_bytes, now_s)

    def packet_left(self, number: int, size_bytes: int, now_s: float) -> None:
        """A packet that has a number for reports of arrivals."""
        self._watch.sent(number, size_bytes, now_s)

    def pace(self, size_bytes: int, waiting: int, now_s: float) -> float:
        """``size_bytes`` have just left (0: somebody asks): seconds until anything else may. ``waiting``: pictures
        behind, which hurry it up."""
        pause_s = self._rate.paused_until_s - now_s
        wait_s = self._pacer.wait_s(size_bytes, sum(self._parts.values()), now_s, self._rate.trains_bps, waiting)
        return max(pause_s, wait_s)

    def wants_copy(self, size_bytes: int, now_s: float) -> bool:
        """Whether a packet that has just left is sent once more, unasked."""
        spare_bps = self._spare_bps(now_s) if self._copies.are_sent else 0.0
        return self._copies.wants(size_bytes, spare_bps, now_s)

    # -- what comes back -----------------------------------------------------------------------------------------

    def seen(self, report: ArrivalReport, now_s: float) -> PathSeen | None:
        """What a report of arrivals says of the path, to be handled; ``None``: nothing."""
        return self._watch.reported(report, now_s)

    def handle(self, stream: Hashable, feedback: Feedback, now_s: float) -> None:
        """What came back for a stream, or for all of them."""
        if isinstance(feedback, ReceiverReport):
            feedback = self._reports.merged(stream, feedback)
        if isinstance(feedback, PathSeen) and not self._hears_arrivals:  # a better controller takes over
            self._hears_arrivals = True
            self._rate = PathRate(*self._limits(), now_s, self._rate.budget_bps)
        if isinstance(feedback, PathSeen) and self.background.reported(feedback, self._rate.usual_s, now_s):
            return
        self._count_data(now_s)
        self._rate.handle(self._with_data(feedback), now_s)
        if isinstance(feedback, PathSeen):
            self._copies.reported(feedback.lost, feedback.received, now_s, is_queued=self._rate.is_queued)
        self._divide()

    def tick(self, now_s: float) -> None:
        """Call it about twice per second."""
        self._count_data(now_s)
        self._rate.tick(now_s)
        self._divide()

    @property
    def budget_bps(self) -> int:
        return self._rate.budget_bps

    @property
    def round_trip_s(self) -> float | None:
        return self._rate.round_trip_s

    @property
    def paused_until_s(self) -> float:
        return self._rate.paused_until_s

    @property
    def doubles_repeats(self) -> bool:
        return self._copies.doubles_repeats

    @property
    def parts(self) -> dict[Hashable, int]:
        return dict(self._parts)

    # ------------------------------------------------------------------------------------------------------------

    def _limits(self) -> tuple[int, int]:
        """What can be no more and no less, such as sound, says nothing of how much may be tried."""
        demands = self._demands.values()
        least_bps, most_bps = (sum(one.least_bps for one in demands), sum(one.most_bps for one in demands))
        return least_bps, most_bps if most_bps > least_bps else max(least_bps, START_BPS)

    def _limit(self) -> None:
        if self._demands:
            self._rate.limit(*self._limits())
        self._divide()

    def _divide(self) -> None:
        self._parts = allocated(self._rate.budget_bps - self._data_bps, self._demands)

    def _count_data(self, now_s: float) -> None:
        self._data_bps = min(self._data.bps(now_s), _MOST_FOR_DATA * self._rate.budget_bps)
        self._rate.carries(self._data_bps, now_s)

    def _with_data(self, feedback: Feedback) -> Feedback:
        """Receivers tell of streams alone; the budget is for all."""
        if isinstance(feedback, PathSeen) and feedback.path_bps is not None:
            path_bps = feedback.path_bps + self._data_bps
            left = None if feedback.left is None else min(1.0, feedback.left * path_bps / feedback.path_bps)
            return replace(feedback, path_bps=path_bps, left=left)
        if isinstance(feedback, BandwidthEstimate):
            return BandwidthEstimate(round(feedback.bitrate_bps + self._data_bps))
        return feedback

    def _spare_bps(self, now_s: float) -> float:
        """What the path takes beside the pictures."""
        total_bps = sum(self._parts.values())
        if not total_bps:
            return 0.0
        factor = min(2.0, (self._rate.most_bps(now_s) - self._data_bps) / total_bps)
        return sum(
            min(factor * part_bps, self._ceilings_bps[stream]) - self.picture_bps(stream, now_s)
            for stream, part_bps in self._parts.items()
        )
