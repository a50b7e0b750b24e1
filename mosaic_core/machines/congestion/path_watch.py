"""Watches what the path does to one stream's packets, from when each was sent and when it arrived: the queue that
stands on the way, what the path takes, and what it loses.

Delays are only compared with each other, so the two clocks need not agree.
"""

from __future__ import annotations

import math
import statistics
from collections import OrderedDict, deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

from mosaic_core.machines.congestion.arrival_report import NUMBERS, ArrivalReport

_REMEMBERED = 4096
_BASE_S = 15.0
"""The shortest delay of one to two such times is that of the empty path."""
_LASTING_S = 60.0
_ABSURD_S = 60.0
"""The receiver's clock began anew."""
_STANDING_S = 0.02
"""Longer than packets of one picture wait for each other on a path that takes it."""
_PATH_WINDOW_S, _PATH_PACKETS, _PATH_LEAST_S = 0.25, 6, 0.04
_WORST_GAP = 0.4
"""Of that time: packets that came all at once after a gap waited for a busy processor, not in a queue."""
_STANDS_AT_MOST_S = 4.0
"""Senders stop for a queue of their own. What stands longer is a longer way."""
_TRAIN_GAP_S = 0.0015
"""Packets of one picture that are not paced leave closer than this."""
_SPREAD = 1.3
"""A train that comes no wider than it left met nothing that is slower than its sender."""
_TRAIN_PACKETS = 2
_TRAINS_WINDOW_S, _LEAST_TRAINS, _LEAST_QUEUED_TRAINS = 1.5, 6, 3
_LEAST_LEFT = 0.75
"""Of what was ours: where all of them make way, each has to give less."""
FASTEST_BPS = 50_000_000.0
"""More is not told apart: receivers give times in quarters of a millisecond."""


@dataclass(frozen=True, slots=True)
class PathSeen:
    """The state of a path, as one report of arrivals tells it. ``queue_s``: the least that any packet waited;
    ``newest_queue_s``: the last one, which was sent at ``newest_sent_s``; ``empties_in_s``: when the queue will have
    drained if nothing more is sent.

    ``path_bps``: what came through while a queue stood: what the path takes. ``trains_bps``: how fast the packets of
    single pictures followed each other lately: about what it would take. ``left``: of that, the part which other
    streams on the way left to this one while a queue stood. ``None``: too few to tell. ``waited_s``: the least that any
    packet waited compared with the last minute or two, in which a queue of others may have stood all the while.
    """

    queue_s: float
    newest_queue_s: float
    newest_sent_s: float
    received: int
    lost: int
    empties_in_s: float = 0.0
    path_bps: float | None = None
    trains_bps: float | None = None
    left: float | None = None
    waited_s: float = 0.0


@dataclass(frozen=True, slots=True)
class _Arrived:
    sent_s: float
    at_s: float
    size_bytes: int


class _Least:
    """The shortest delay of the last one to two times ``over_s``."""

    def __init__(self, over_s: float) -> None:
        self._over_s = over_s
        self._now_s = self._before_s = math.inf
        self._since_s = 0.0

    def noted(self, least_s: float, now_s: float) -> float:
        if abs(least_s - self._now_s) > _ABSURD_S:
            return self.begin(least_s, now_s)
        if now_s - self._since_s > self._over_s:
            self._now_s, self._before_s, self._since_s = least_s, self._now_s, now_s
        self._now_s = min(least_s, self._now_s)
        return min(self._now_s, self._before_s)

    def begin(self, least_s: float, now_s: float) -> float:
        """Anew."""
        self._now_s = self._before_s = least_s
        self._since_s = now_s
        return least_s


class PathWatch:
    """Watches the path of one stream's packets. ``number`` counts the connection's packets modulo 2^16; other streams
    have some of them.
    """

    def __init__(self) -> None:
        self._on_the_way: OrderedDict[int, tuple[float, int]] = OrderedDict()
        self._base, self._lasting = _Least(_BASE_S), _Least(_LASTING_S)
        self._empty_at_s: float | None = None
        self._queued: deque[_Arrived] = deque()
        self._trains: deque[tuple[float, float]] = deque()

    def sent(self, number: int, size_bytes: int, now_s: float) -> None:
        self._on_the_way[number] = (now_s, size_bytes)
        self._on_the_way.move_to_end(number)
        if len(self._on_the_way) > _REMEMBERED:
            self._on_the_way.popitem(last=False)

    def reported(self, report: ArrivalReport, now_s: float) -> PathSeen | None:
        """What this report says; ``None`` if it has no packet of this stream that arrived."""
        arrived, lost = self._taken(report)
        if not arrived:
            return None
        least_s = min(one.at_s - one.sent_s for one in arrived)
        base_s = self._base.noted(least_s, now_s)
        if self._stands_too_long(least_s - base_s, now_s):
            base_s = self._base.begin(least_s, now_s)
        queues = [one.at_s - one.sent_s - base_s for one in arrived]
        self._note_queued(arrived, queues)
        self._note_trains(arrived, now_s)
        newest, path_bps = arrived[-1], self._path_bps()
        return PathSeen(
            min(queues),
            queues[-1],
            newest.sent_s,
            len(arrived),
            lost,
            self._empties_in_s(newest.sent_s, queues[-1], path_bps, now_s),
            path_bps,
            self._trains_bps(now_s),
            self._left(path_bps),
            least_s - self._lasting.noted(least_s, now_s),
        )

    def _taken(self, report: ArrivalReport) -> tuple[list[_Arrived], int]:
        arrived, missing = [], []
        for offset, at_s in enumerate(report.arrivals_s):
            number = (report.first_number + offset) % NUMBERS
            if number not in self._on_the_way:
                continue
            if at_s is None:
                missing.append(number)
            else:
                sent_s, size_bytes = self._on_the_way.pop(number)
                arrived.append(_Arrived(sent_s, at_s, size_bytes))
        for number in missing:
            del self._on_the_way[number]
        return arrived, len(missing)

    def _stands_too_long(self, queue_s: float, now_s: float) -> bool:
        if self._empty_at_s is None or queue_s < _STANDING_S:
            self._empty_at_s = now_s
        return now_s - self._empty_at_s > _STANDS_AT_MOST_S

    # -- what the path takes -------------------------------------------------------------------------------------

    def _note_queued(self, arrived: Sequence[_Arrived], queues: Sequence[float]) -> None:
        for one, queue_s in zip(arrived, queues, strict=True):
            if queue_s < _STANDING_S:
                self._queued.clear()
            else:
                self._queued.append(one)
        while self._queued and self._queued[0].at_s < arrived[-1].at_s - _PATH_WINDOW_S:
            self._queued.popleft()

    def _path_bps(self) -> float | None:
        if len(self._queued) < _PATH_PACKETS:
            return None
        span_s = self._queued[-1].at_s - self._queued[0].at_s
        gap_s = max(late.at_s - early.at_s for early, late in pairwise(self._queued))
        is_steady = span_s >= _PATH_LEAST_S and gap_s <= _WORST_GAP * span_s
        return _rate_bps(self._queued, span_s) if is_steady else None

    def _left(self, path_bps: float | None) -> float | None:
        """What came through of ours, less what the queue grew by: others go on sending what they send. Both speeds are
        of the same packets, so a path that has just become narrower isn't taken for a shared one."""
        trains_bps = _speeds_bps(self._queued)
        if path_bps is None or len(trains_bps) < _LEAST_QUEUED_TRAINS:
            return None
        ours = min(1.0, path_bps / statistics.median(trains_bps))
        first, last = self._queued[0], self._queued[-1]
        growth = (last.at_s - first.at_s) / max(1e-3, last.sent_s - first.sent_s) - 1.0
        return min(1.0, max(_LEAST_LEFT * ours, ours - growth * (1.0 - ours)))

    def _note_trains(self, arrived: Sequence[_Arrived], now_s: float) -> None:
        self._trains.extend((now_s, bps) for bps in _speeds_bps(arrived))

    def _trains_bps(self, now_s: float) -> float | None:
        while self._trains and self._trains[0][0] < now_s - _TRAINS_WINDOW_S:
            self._trains.popleft()
        if len(self._trains) < _LEAST_TRAINS:
            return None
        return statistics.median(bps for _, bps in self._trains)

    def _empties_in_s(self, newest_sent_s: float, queue_s: float, path_bps: float | None, now_s: float) -> float:
        if path_bps is None:
            return 0.0
        behind_bits = 8 * sum(size for sent_s, size in self._on_the_way.values() if sent_s > newest_sent_s)
        return max(0.0, newest_sent_s + queue_s + behind_bits / path_bps - now_s)


def _speeds_bps(arrived: Iterable[_Arrived]) -> list[float]:
    """Of each train in there."""
    trains: list[list[_Arrived]] = []
    for one in arrived:
        if not trains or not 0.0 <= one.sent_s - trains[-1][-1].sent_s <= _TRAIN_GAP_S:
            trains.append([])
        trains[-1].append(one)
    return [_speed_bps(train) for train in trains if len(train) >= _TRAIN_PACKETS]


def _speed_bps(train: Sequence[_Arrived]) -> float:
    span_s, left_s = train[-1].at_s - train[0].at_s, train[-1].sent_s - train[0].sent_s
    return _rate_bps(train, span_s) if span_s > _SPREAD * left_s else FASTEST_BPS


def _rate_bps(arrived: Sequence[_Arrived], span_s: float) -> float:
    """Of what came after the first one."""
    bits = 8 * (sum(one.size_bytes for one in arrived) - arrived[0].size_bytes)
    return min(FASTEST_BPS, bits / max(span_s, 1e-6))
