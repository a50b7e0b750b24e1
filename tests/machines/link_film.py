"""One operator's video over a bad link, played in milliseconds: the machines as the feed puts them together, an encoder
and a receiver as Chromium is one. Films that share a clock and a link meet in its queue."""

from __future__ import annotations

import heapq
import itertools
import random
from collections.abc import Callable
from dataclasses import dataclass, field

from mosaic_core.machines.congestion.arrival_report import ArrivalReport
from mosaic_core.machines.congestion.budget_allocator import Demand
from mosaic_core.machines.congestion.connection_budget import ConnectionBudget
from mosaic_core.machines.congestion.feedback import ReceiverReport
from mosaic_core.machines.congestion.missing_packets import MissingPackets
from mosaic_core.machines.congestion.retransmissions import Retransmissions
from mosaic_core.machines.laboratory.impaired_link import ImpairedLink, LinkProfile
from mosaic_core.machines.media.key_frame_requests import KeyFrameRequests
from mosaic_core.machines.media.rung_choice import RungChoice
from mosaic_core.machines.media.rung_ladder import ladder

FPS, DELAY_MS = 30, 25.0
ROUND_TRIP_S = 2 * DELAY_MS / 1e3
REPORT_S, NACK_AGAIN_S = 0.06, 0.1
PACKET_BYTES = 1250
KEY_BYTES = 21_000
"""Of a full picture of noise, whatever the bit rate; smaller ones in proportion."""
FREEZE_S = 0.2
COPY_AFTER_S = 0.01


def profile(rate_mbps: float | None = None, loss: float = 0.0) -> LinkProfile:
    return LinkProfile("test", delay_ms=DELAY_MS, loss=loss, rate_mbps=rate_mbps, queue_ms=500)


@dataclass
class Picture:
    captured_s: float
    is_key: bool
    missing: set[int]
    needs: Picture | None


class Clock:
    """What is due, in order."""

    def __init__(self) -> None:
        self.now_s = 0.0
        self._due: list[tuple[float, int, Callable[[], object]]] = []
        self._order = itertools.count()

    def at(self, time_s: float, act: Callable[[], object]) -> None:
        heapq.heappush(self._due, (time_s, next(self._order), act))

    def play(self, seconds: float) -> None:
        until_s = self.now_s + seconds
        while self._due[0][0] <= until_s:
            self.now_s, _, act = heapq.heappop(self._due)
            act()
        self.now_s = until_s


class OperatorConnection:
    """What all films of one operator share: the budget, the numbers of packets, and the reports of their arrivals."""

    def __init__(self, film: Film) -> None:
        self.budget = ConnectionBudget(film.now_s)
        self.films: list[Film] = []
        self.numbers = itertools.count(1)
        self.arrived: dict[int, float] = {}
        self.next_reported = 1
        self.busy_until_s = 0.0
        film.at(film.now_s + film.later_s + REPORT_S, self.report)
        film.at(film.now_s + film.later_s + 0.5, self.tick)

    def report(self) -> None:
        film = self.films[0]
        film.at(film.now_s + REPORT_S, self.report)
        if not self.arrived:
            return
        first, last = self.next_reported, max(self.arrived)
        times = tuple(self.arrived.get(number) for number in range(first, last + 1))
        self.next_reported, self.arrived = last + 1, {}
        film.over(film.back, 100, lambda: self.hear(ArrivalReport(first % 65536, times)))

    def hear(self, report: ArrivalReport) -> None:
        now_s = self.films[0].now_s
        seen = self.budget.seen(report, now_s)
        if seen is not None:
            self.budget.handle(None, seen, now_s)
        for film in self.films:
            for sequence in film.missing.reported(report):
                film.asked(sequence)

    def tick(self) -> None:
        film = self.films[0]
        film.at(film.now_s + 0.5, self.tick)
        self.budget.handle(film.key, ReceiverReport(0, 0, ROUND_TRIP_S), film.now_s)
        self.budget.tick(film.now_s)


@dataclass
class Film:
    """Plays. ``shown``: (displayed at, age) of every picture, in order. ``beside``: a film on the same link, whose
    pictures are taken ``later_s`` before its own; ``shares``: the same operator sees that one."""

    link_profile: LinkProfile
    seed: int = 1
    beside: Film | None = None
    later_s: float = 0.0
    shares: bool = False
    shown: list[tuple[float, float]] = field(default_factory=list)
    rates: list[tuple[float, int]] = field(default_factory=list)
    sent_bytes: int = 0

    def __post_init__(self) -> None:
        self.chance = random.Random(self.seed)
        self.clock = self.beside.clock if self.beside else Clock()
        self.link = self.beside.link if self.beside else ImpairedLink(self.link_profile)
        self.back = self.beside.back if self.beside else ImpairedLink(self.link_profile)
        self.connection = self.beside.connection if self.beside and self.shares else OperatorConnection(self)
        self.connection.films.append(self)
        self.rungs, self.key = ladder(1280, 720), object()
        self.look()
        self.repeats, self.keys, self.missing = Retransmissions(), KeyFrameRequests(), MissingPackets()
        self.sequence = itertools.count(1)
        self.of: dict[int, Picture] = {}
        self.seen_up_to = 0
        self.encoded: tuple[int, float] | None = None
        self.pictures: list[Picture] = []
        self.next_shown = 0
        self.last: Picture | None = None
        self.latest_shown: Picture | None = None
        self.debt_bytes = 0.0
        self.is_torn = False
        self.at(self.now_s + self.later_s, self.film)

    # -- time ------------------------------------------------------------------------------------------------------

    @property
    def now_s(self) -> float:
        return self.clock.now_s

    def at(self, time_s: float, act: Callable[[], object]) -> None:
        self.clock.at(time_s, act)

    def play(self, seconds: float) -> Film:
        self.clock.play(seconds)
        return self

    def over(self, link: ImpairedLink, size_bytes: int, act: Callable[[], object]) -> None:
        arrival_s = link.arrival_s(size_bytes, self.now_s, self.chance.random(), 0.0, 1.0)
        if arrival_s is not None:
            self.at(arrival_s, act)

    def become(self, changed: LinkProfile) -> None:
        self.link.profile = self.back.profile = changed

    # -- the robot -------------------------------------------------------------------------------------------------

    def look(self) -> None:
        """The operator looks at it (again)."""
        self.is_watched = True
        self.budget.want(self.key, Demand(150_000, self.rungs[0].ceiling_bps))
        self.choice = RungChoice(self.rungs, self.picture_bps, self.now_s)

    def look_away(self) -> None:
        self.is_watched, self.is_torn = False, True
        self.budget.want_nothing(self.key)
        self.keys.ask()

    @property
    def budget(self) -> ConnectionBudget:
        return self.connection.budget

    @property
    def part_bps(self) -> int:
        return self.budget.part_bps(self.key)

    @property
    def picture_bps(self) -> int:
        return self.budget.picture_bps(self.key, self.now_s)

    @property
    def encoder_bps(self) -> int:
        """What the encoder is asked for, which may have other viewers."""
        return self.picture_bps

    def film(self) -> None:
        self.at(self.now_s + 1 / FPS, self.film)
        if not self.is_watched:
            return
        self.rates.append((self.now_s, self.part_bps))
        if self.now_s < self.budget.paused_until_s:
            return
        index = self.choice.decide(self.picture_bps, self.now_s)
        rung = self.rungs[index]
        target_bps = min(rung.ceiling_bps, max(rung.floor_bps, self.encoder_bps))
        is_key = self.keys.take(self.now_s)
        if self.encoded is None or self.encoded[0] != index or not 0.9 < target_bps / self.encoded[1] < 1.4:
            self.encoded, is_key = (index, target_bps), True  # libvpx is made anew, with a key frame
            self.keys.made(self.now_s)
        size_bytes = target_bps / 8 / FPS
        if is_key:
            key_bytes = KEY_BYTES * (rung.width / 1280) ** 1.5
            self.debt_bytes += key_bytes - size_bytes
            size_bytes = key_bytes
        else:
            saved_bytes = min(self.debt_bytes, size_bytes * 0.4)
            self.debt_bytes -= saved_bytes
            size_bytes = (size_bytes - saved_bytes) * self.chance.uniform(0.8, 1.2)
        if is_key or not self.is_torn:
            self.is_torn = False
            self.send(round(size_bytes), is_key=is_key)

    def send(self, size_bytes: int, *, is_key: bool) -> None:
        sizes = [PACKET_BYTES] * (size_bytes // PACKET_BYTES) + [max(100, size_bytes % PACKET_BYTES)]
        picture = Picture(self.now_s, is_key, set(), None if is_key else self.last)
        self.budget.sent(size_bytes, self.now_s, is_key=is_key)
        self.last = picture
        self.pictures.append(picture)
        wait_s, to_copy = max(0.0, self.connection.busy_until_s - self.now_s), []
        for size in sizes:
            sequence = next(self.sequence)
            picture.missing.add(sequence)
            self.of[sequence] = picture
            self.at(self.now_s + wait_s, lambda sequence=sequence, size=size: self.leave(sequence, size))  # type: ignore[misc]
            wait_s += self.budget.pace(size, 0, self.now_s + wait_s)
            if self.budget.wants_copy(size, self.now_s):
                to_copy.append((sequence, size))
        self.connection.busy_until_s = self.now_s + wait_s
        for sequence, size in to_copy:
            self.repeats.note(sequence, self.now_s)
            self.budget.sent(size, self.now_s)
            self.at(self.now_s + wait_s + COPY_AFTER_S, lambda one=sequence, of=size: self.leave(one, of))  # type: ignore[misc]

    def leave(self, sequence: int, size_bytes: int) -> None:
        number = next(self.connection.numbers)
        self.sent_bytes += size_bytes
        self.budget.packet_left(number % 65536, size_bytes, self.now_s)
        self.missing.sent(number % 65536, sequence)
        self.over(self.link, size_bytes, lambda: self.arrive(sequence, number))

    def asked(self, sequence: int) -> None:
        if self.repeats.may(sequence, self.part_bps, self.budget.round_trip_s, self.now_s):
            for _ in range(2 if self.budget.doubles_repeats else 1):
                self.budget.sent(PACKET_BYTES, self.now_s)
                self.leave(sequence, PACKET_BYTES)
        elif self.repeats.is_exhausted:
            self.keys.ask()

    # -- the operator ----------------------------------------------------------------------------------------------

    def arrive(self, sequence: int, number: int) -> None:
        self.connection.arrived[number] = self.now_s
        for missed in range(self.seen_up_to + 1, sequence):
            self.ask(missed)
        self.seen_up_to = max(self.seen_up_to, sequence)
        picture = self.of[sequence]
        picture.missing.discard(sequence)
        self.show()

    def ask(self, sequence: int) -> None:
        if sequence in self.of[sequence].missing and self.now_s < self.of[sequence].captured_s + 2.0:
            self.over(self.back, 60, lambda: self.asked(sequence))
            self.at(self.now_s + NACK_AGAIN_S, lambda: self.ask(sequence))

    def show(self) -> None:
        """All that can be decoded by now: complete, and what it builds on was shown; or a complete key frame."""
        for index in range(self.next_shown, len(self.pictures)):
            picture = self.pictures[index]
            if not picture.missing and (picture.is_key or picture.needs is self.latest_shown):
                self.next_shown, self.latest_shown = index + 1, picture
                self.shown.append((self.now_s, self.now_s - picture.captured_s))

    # -- what it was like ------------------------------------------------------------------------------------------

    def freezes(self, from_s: float) -> int:
        times = [at_s for at_s, _ in self.shown if at_s >= from_s] + [self.now_s]
        return sum(late - early > FREEZE_S for early, late in itertools.pairwise([from_s, *times]))

    def ages_ms(self, from_s: float) -> list[float]:
        return sorted(1e3 * age_s for at_s, age_s in self.shown if at_s >= from_s)

    def p95_ms(self, from_s: float) -> float:
        ages = self.ages_ms(from_s)
        return ages[len(ages) * 95 // 100]

    def well_again_s(self, from_s: float, limit_ms: float) -> float:
        """From when on no picture is older than that and none is missing, for two seconds."""
        bad = [at_s for at_s, age_s in self.shown if at_s >= from_s and 1e3 * age_s > limit_ms]
        times = [from_s, *(at_s for at_s, _ in self.shown if at_s >= from_s)]
        bad += [late for early, late in itertools.pairwise(times) if late - early > FREEZE_S]
        until = next((late for early, late in itertools.pairwise(sorted([from_s, *bad, 1e9])) if late - early > 2), 0)
        return max((at for at in bad if at < until), default=from_s) - from_s
