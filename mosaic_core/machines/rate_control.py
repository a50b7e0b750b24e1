"""How many bits per second one viewer's link takes: starts low, ramps up, backs off when it hurts, recovers.

It grows with every receiver report that is clean, and shrinks by what operators report: loss, a round trip that gets
longer (a queue fills up somewhere), packets asked for again, pictures lost, a bandwidth estimate, or silence.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TypeAlias

START_BPS = 800_000
"""Most links take it; a picture at this rate is neither blocky nor tiny."""
_FAST_GROWTH, _GROWTH, _CAREFUL_GROWTH = 1.5, 1.15, 1.03
"""Per second: before the first congestion; after one; near the rate where the last one was."""
_IDLE_GROWTH = 1.08
"""While the pictures need less than half of it nothing is proved by clean reports."""
_CLEAN_LOSS, _BAD_LOSS = 0.04, 0.10
"""Radio links lose a few percent at any rate; beyond a tenth the rate itself is the cause (as in RFC 8698 §5.1)."""
_BACK_OFF = 0.8
_MIN_BACK_OFF = 0.5
_BACK_OFF_INTERVAL_S = 0.9
"""One back-off per report: the next one tells whether it was enough."""
_QUEUE_S = 0.12
"""A round trip longer than the shortest one by this: a queue stands, and pictures arrive late by it."""
_MANY_MISSING = 0.2
"""Of the packets of the last second, as NACKs count them; they come long before the report."""
_LOST_PICTURES, _LOST_WITHIN_S = 3, 3.0
_ESTIMATE_USED = 0.8
"""A receiver estimates 1.5 times what it gets: it limits us only when we send about that much."""
_ESTIMATE_AGE_S = 5.0
_SILENT_S = 4.0
"""Reports come once per second."""
_MEMORY_S = 20.0
"""For so long the rate of the last congestion is approached with care. Links get better again."""
_ROUND_TRIP_MEMORY_S = 30.0
_WINDOW_S = 1.0
_BITS_PER_PACKET = 1200 * 8


@dataclass(frozen=True, slots=True)
class ReceiverReport:
    """RTCP receiver report: share of packets lost since the last one, and the round trip if it is known."""

    fraction_lost: float
    round_trip_s: float | None = None


@dataclass(frozen=True, slots=True)
class BandwidthEstimate:
    """REMB: what the receiver thinks that the path takes, for all that it receives."""

    bitrate_bps: int


@dataclass(frozen=True, slots=True)
class PacketsMissing:
    """NACK: packets asked for again."""

    count: int


@dataclass(frozen=True, slots=True)
class PictureLost:
    """PLI or FIR: the decoder can't go on without a key frame."""


Feedback: TypeAlias = ReceiverReport | BandwidthEstimate | PacketsMissing | PictureLost


class RateControl:
    """Of one viewer. ``now_s``: any monotonic clock. Tell it what was sent, what came back, and the time."""

    def __init__(self, min_bps: int, max_bps: int, now_s: float) -> None:
        self._min_bps = min_bps
        self._max_bps = max(min_bps, max_bps)
        self._budget_bps = float(min(self._max_bps, max(min_bps, START_BPS)))
        self._sent: deque[tuple[float, int]] = deque()
        self._missing: deque[tuple[float, int]] = deque()
        self._lost_pictures: deque[float] = deque(maxlen=_LOST_PICTURES)
        self._round_trips: deque[tuple[float, float]] = deque()
        self._estimate: tuple[float, int] | None = None
        self._congested: tuple[float, float] | None = None
        self._backed_off_at_s = now_s - _BACK_OFF_INTERVAL_S
        self._grown_at_s = now_s
        self._heard_at_s = now_s

    @property
    def budget_bps(self) -> int:
        return round(self._budget_bps)

    def sent_bps(self, now_s: float) -> float:
        """What was sent during the last second."""
        _forget(self._sent, now_s)
        return sum(size for _, size in self._sent) * 8 / _WINDOW_S

    def limit(self, min_bps: int, max_bps: int) -> None:
        """The source changed: other limits hold."""
        self._min_bps, self._max_bps = min_bps, max(min_bps, max_bps)
        self._set(self._budget_bps)

    def sent(self, size_bytes: int, now_s: float) -> None:
        self._sent.append((now_s, size_bytes))
        _forget(self._sent, now_s)

    def handle(self, feedback: Feedback, now_s: float) -> None:
        """Something came back from the viewer."""
        match feedback:
            case ReceiverReport(fraction_lost, round_trip_s):
                self._heard_at_s = now_s
                self._reported(fraction_lost, self._queue_stands(round_trip_s, now_s), now_s)
            case BandwidthEstimate(bitrate_bps):
                self._estimate = (now_s, bitrate_bps)
            case PacketsMissing(count):
                self._missing.append((now_s, count))
                self._check_missing(now_s)
            case PictureLost():
                self._lost_pictures.append(now_s)
                self._check_lost_pictures(now_s)
        self._obey_estimate(now_s)

    def tick(self, now_s: float) -> None:
        """Call it about twice per second: silence is news too."""
        if self._sent and now_s - self._heard_at_s >= _SILENT_S:
            self._back_off(_MIN_BACK_OFF, now_s, interval_s=_SILENT_S / 2)
        self._obey_estimate(now_s)

    # -- up ------------------------------------------------------------------------------------------------------

    def _reported(self, lost: float, has_queue: bool, now_s: float) -> None:
        elapsed_s = min(2.0, max(0.0, now_s - self._grown_at_s))
        self._grown_at_s = now_s
        if lost > _BAD_LOSS:
            self._back_off(max(_MIN_BACK_OFF, 1.0 - lost / 2), now_s)
        elif has_queue:
            self._back_off(_BACK_OFF, now_s)
        elif lost <= _CLEAN_LOSS and now_s - self._backed_off_at_s >= _BACK_OFF_INTERVAL_S:
            self._set(self._budget_bps * self._growth(now_s) ** elapsed_s)

    def _growth(self, now_s: float) -> float:
        """Factor per second."""
        if self.sent_bps(now_s) < self._budget_bps / 2:
            return _IDLE_GROWTH
        if self._congested is None:
            return _FAST_GROWTH
        at_s, at_bps = self._congested
        is_near = now_s - at_s < _MEMORY_S and self._budget_bps > at_bps * 0.85
        return _CAREFUL_GROWTH if is_near else _GROWTH

    # -- down ----------------------------------------------------------------------------------------------------

    def _back_off(self, factor: float, now_s: float, interval_s: float = _BACK_OFF_INTERVAL_S) -> None:
        if now_s - self._backed_off_at_s < interval_s:
            return
        self._backed_off_at_s = now_s
        self._congested = (now_s, self._budget_bps)
        # What was not even sent can't be what hurt: cut from what was.
        used_bps = max(self.sent_bps(now_s), self._budget_bps / 2)
        self._set(min(self._budget_bps, used_bps) * factor)

    def _queue_stands(self, round_trip_s: float | None, now_s: float) -> bool:
        if round_trip_s is None:
            return False
        self._round_trips.append((now_s, round_trip_s))
        while self._round_trips[0][0] < now_s - _ROUND_TRIP_MEMORY_S:
            self._round_trips.popleft()
        shortest_s = min(value for _, value in self._round_trips)
        return round_trip_s > max(2 * shortest_s, shortest_s + _QUEUE_S)

    def _check_missing(self, now_s: float) -> None:
        _forget(self._missing, now_s)
        missing = sum(count for _, count in self._missing)
        packets = max(10.0, self.sent_bps(now_s) / _BITS_PER_PACKET)
        if missing > _MANY_MISSING * packets:
            self._back_off(_BACK_OFF, now_s)

    def _check_lost_pictures(self, now_s: float) -> None:
        lost = self._lost_pictures
        if len(lost) == _LOST_PICTURES and now_s - lost[0] <= _LOST_WITHIN_S:
            lost.clear()
            self._back_off(_BACK_OFF, now_s)

    def _obey_estimate(self, now_s: float) -> None:
        if self._estimate is None:
            return
        at_s, estimate_bps = self._estimate
        is_fresh = now_s - at_s <= _ESTIMATE_AGE_S
        if is_fresh and estimate_bps < self._budget_bps and self.sent_bps(now_s) >= _ESTIMATE_USED * estimate_bps:
            self._congested = (now_s, float(estimate_bps))
            self._set(float(estimate_bps))

    def _set(self, budget_bps: float) -> None:
        self._budget_bps = min(float(self._max_bps), max(float(self._min_bps), budget_bps))


def _forget(events: deque[tuple[float, int]], now_s: float) -> None:
    while events and events[0][0] <= now_s - _WINDOW_S:
        events.popleft()
