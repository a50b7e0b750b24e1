"""Estimates the bit rate that one connection takes, by the simple reports that any receiver sends: starts low, ramps
up, backs off when it hurts, recovers.

It grows with every receiver report that is clean, and shrinks by what operators report: loss, a round trip that gets
longer (a queue fills up somewhere), packets asked for again, pictures lost, a bandwidth estimate, or silence.
"""

from __future__ import annotations

import math
from collections import deque

from mosaic_core.machines.congestion.congestion_controller import CongestionController, forget
from mosaic_core.machines.congestion.feedback import (
    BandwidthEstimate,
    Feedback,
    PacketsMissing,
    PictureLost,
    ReceiverReport,
)

START_BPS = 800_000
"""Most links take it; a picture at this rate is neither blocky nor tiny."""
_FAST_GROWTH, _GROWTH, _CAREFUL_GROWTH = 1.5, 1.25, 1.03
"""Per second: before the first congestion; after one; near the rate where the last one was."""
_IDLE_GROWTH = 1.08
"""While the pictures need less than half of it nothing is proved by clean reports."""
_NEAR_FROM, _NEAR_TO = 0.9, 1.1
"""Of the rate of the last congestion. Beyond it the path evidently takes more by now."""
_CLEAN_LOSS, _BAD_LOSS = 0.04, 0.12
"""Radio links lose a few percent at any rate; beyond a tenth the rate itself is the cause (RFC 8698 §5.1 has 10 %)."""
_JUDGED_S, _JUDGED_PACKETS, _JUDGED_LATEST_S = 0.5, 100, 1.5
"""Browsers send a report with every NACK: single ones are about a handful of packets and mean nothing. Of few packets
a link that loses 8 % easily loses 15 %, so that as many as chance explains are not held against it."""
_BACK_OFF, _MIN_BACK_OFF = 0.8, 0.5
_LEAST, _QUEUE_LEAST = 0.2, 0.6
"""However little the receiver estimates. A queue without loss is no reason to mistrust the path entirely."""
_DRAIN = 0.75
"""Of what the path takes: as long as more is sent than drains, the queue stays and every picture waits in it."""
_BACK_OFF_INTERVAL_S, _QUEUE_INTERVAL_S = 1.0, 2.0
"""The next reports tell whether it was enough; a queue needs longer to drain."""
_QUEUE_S = 0.12
"""A round trip longer than the shortest one by this: a queue stands, and pictures arrive late by it."""
_MANY_MISSING, _LEAST_MISSING = 0.3, 10
"""Of the packets of the last second, as NACKs count them (again and again); they come long before the report."""
_LOST_PICTURES, _LOST_WITHIN_S = 3, 3.0
_ESTIMATE_USED = 0.8
"""A receiver estimates 1.5 times what it gets: it limits us only when we send about that much."""
_ESTIMATE_AGE_S = 5.0
"""Browsers estimate by the delays of single packets and often far too little (a third, on loopback): an estimate
decides how far to back off when a report shows loss or a queue, and by itself only slows growth down."""
_LEAST_OF_ESTIMATE = 0.4
_SILENT_S = 4.0
"""Reports come once per second."""
_MEMORY_S = 20.0
"""For so long the rate of the last congestion is approached with care. Links get better again."""
_ROUND_TRIP_MEMORY_S = 30.0
_WINDOW_S = 1.0
_PACKET_BYTES = 1200


class RateControl(CongestionController):
    """Sets the bit rate of one connection without reports of arrivals. It sends no copies: that there is room for more
    is never certain."""

    silent_s = _SILENT_S

    def __init__(self, min_bps: int, max_bps: int, now_s: float) -> None:
        super().__init__(min_bps, max_bps, now_s, START_BPS)
        self._missing: deque[tuple[float, int]] = deque()
        self._lost_pictures: deque[float] = deque(maxlen=_LOST_PICTURES)
        self._round_trips: deque[tuple[float, float]] = deque()
        self._judged: tuple[float, ReceiverReport] | None = None
        self._estimate: tuple[float, int] | None = None
        self._backed_off_at_s = now_s - _QUEUE_INTERVAL_S
        self._grown_at_s = now_s

    def handle(self, feedback: Feedback, now_s: float) -> None:
        match feedback:
            case ReceiverReport():
                self._heard_at_s = now_s
                self._remember_round_trip(feedback.round_trip_s, now_s)
                self._judge(feedback, now_s)
            case BandwidthEstimate(bitrate_bps):
                self._estimate = (now_s, bitrate_bps)
            case PacketsMissing(count):
                self._missing.append((now_s, count))
                self._check_missing(now_s)
            case PictureLost():
                self._lost_pictures.append(now_s)
                self._check_lost_pictures(now_s)

    def tick(self, now_s: float) -> None:
        if self._sent and now_s - self._heard_at_s >= _SILENT_S:
            self._back_off(_MIN_BACK_OFF, now_s, interval_s=_SILENT_S / 2)

    # -- up ------------------------------------------------------------------------------------------------------

    def _judge(self, report: ReceiverReport, now_s: float) -> None:
        if self._judged is None:
            self._judged = (now_s, report)
            return
        since_s, before = self._judged
        expected = report.highest_sequence - before.highest_sequence
        waited_s = now_s - since_s
        if expected <= 0 or waited_s < _JUDGED_S or (expected < _JUDGED_PACKETS and waited_s < _JUDGED_LATEST_S):
            return
        self._judged = (now_s, report)
        lost = min(1.0, max(0, report.packets_lost - before.packets_lost) / expected)
        by_chance = math.sqrt(lost * (1.0 - lost) / expected)
        self._act_on(lost, max(0.0, lost - by_chance), now_s)

    def _act_on(self, lost: float, surely_lost: float, now_s: float) -> None:
        elapsed_s = min(2.0, now_s - self._grown_at_s)
        self._grown_at_s = now_s
        if surely_lost > _BAD_LOSS:
            self._back_off(max(_MIN_BACK_OFF, 1.0 - lost / 2), now_s)
        elif self._queue_stands(now_s):
            self._back_off(_BACK_OFF, now_s, interval_s=_QUEUE_INTERVAL_S, least=_QUEUE_LEAST)
        elif lost <= _CLEAN_LOSS and now_s - self._backed_off_at_s >= _BACK_OFF_INTERVAL_S:
            self._set(self._budget_bps * self._growth(now_s) ** elapsed_s)

    def _growth(self, now_s: float) -> float:
        """Factor per second."""
        if self.sent_bps(now_s) < self._budget_bps / 2:
            return _IDLE_GROWTH
        if self._congested is None:
            return _FAST_GROWTH if self._estimate_below(now_s) is None else _GROWTH
        at_s, path_bps = self._congested
        is_near = now_s - at_s < _MEMORY_S and _NEAR_FROM < self._budget_bps / path_bps < _NEAR_TO
        return _CAREFUL_GROWTH if is_near else _GROWTH

    # -- down ----------------------------------------------------------------------------------------------------

    def _back_off(
        self, factor: float, now_s: float, *, interval_s: float = _BACK_OFF_INTERVAL_S, least: float = _LEAST
    ) -> None:
        """To what the path takes, as far as that is known, less what drains the queue. ``factor`` if nothing is known,
        ``least``: no further down than this share of the budget."""
        if now_s - self._backed_off_at_s < interval_s:
            return
        self._backed_off_at_s = now_s
        estimate_bps = self._estimate_below(now_s)
        if estimate_bps is not None:
            path_bps = estimate_bps
            self._set(max(estimate_bps * _DRAIN, self._budget_bps * least))
        else:
            # What was not even sent can't be what hurt: cut from what was.
            path_bps = min(self._budget_bps, max(self.sent_bps(now_s), self._budget_bps / 2))
            least_bps = min(self._budget_bps, _LEAST_OF_ESTIMATE * self._fresh_estimate_bps(now_s))
            self._set(max(path_bps * factor, least_bps))
        self._congested = (now_s, max(path_bps, self._fresh_estimate_bps(now_s)))

    def _remember_round_trip(self, round_trip_s: float | None, now_s: float) -> None:
        if round_trip_s is not None:
            self._round_trips.append((now_s, round_trip_s))
        while self._round_trips and self._round_trips[0][0] < now_s - _ROUND_TRIP_MEMORY_S:
            self._round_trips.popleft()
        self.round_trip_s = self._round_trips[-1][1] if self._round_trips else None

    def _queue_stands(self, now_s: float) -> bool:
        if not self._round_trips or now_s - self._round_trips[-1][0] > 2 * _WINDOW_S:
            return False
        shortest_s = min(value for _, value in self._round_trips)
        return self._round_trips[-1][1] > max(2 * shortest_s, shortest_s + _QUEUE_S)

    def _check_missing(self, now_s: float) -> None:
        forget(self._missing, now_s)
        missing = sum(count for _, count in self._missing)
        packets = self.sent_bps(now_s) / (8 * _PACKET_BYTES)
        if missing > max(_LEAST_MISSING, _MANY_MISSING * packets):
            self._back_off(_BACK_OFF, now_s)

    def _check_lost_pictures(self, now_s: float) -> None:
        lost = self._lost_pictures
        if len(lost) == _LOST_PICTURES and now_s - lost[0] <= _LOST_WITHIN_S:
            lost.clear()
            self._back_off(_BACK_OFF, now_s)

    def _fresh_estimate_bps(self, now_s: float) -> float:
        if self._estimate is None or now_s - self._estimate[0] > _ESTIMATE_AGE_S:
            return 0.0
        return float(self._estimate[1])

    def _estimate_below(self, now_s: float) -> float | None:
        """A fresh estimate that is less than the budget although so much is sent."""
        estimate_bps = self._fresh_estimate_bps(now_s)
        is_tested = self.sent_bps(now_s) >= _ESTIMATE_USED * estimate_bps
        return estimate_bps if estimate_bps > 0 and is_tested and estimate_bps < self._budget_bps else None
