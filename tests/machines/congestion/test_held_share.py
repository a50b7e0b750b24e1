"""A share of the link is held against those who fill its queue, and against nobody else."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.congestion.held_share import (
    DRAINED_S,
    HOLDS_S,
    LETS_GO_S,
    QUEUE_S,
    SHARE,
    STANDS_S,
    HeldShare,
)
from mosaic_core.machines.congestion.path_watch import PathSeen

LINK_BPS = 1_000_000.0
LITTLE_BPS = 0.2 * LINK_BPS
EVERY_S = 0.1


def seen(waited_s: float, *, lost: int = 0, trains_bps: float | None = LINK_BPS) -> PathSeen:
    return PathSeen(waited_s, waited_s, 0.0, 10 - lost, lost, trains_bps=trains_bps, waited_s=waited_s)


class Reports:
    """Ten per second, beginning at 0."""

    def __init__(self) -> None:
        self.share, self.now_s = HeldShare(0.0), 0.0

    def go_on(self, seconds: float, report: PathSeen, budget_bps: float = LITTLE_BPS) -> None:
        for _ in range(round(seconds / EVERY_S)):
            self.now_s += EVERY_S
            self.share.reported(report, budget_bps, self.now_s)

    @property
    def least_bps(self) -> float:
        return self.share.least_bps(self.now_s)


@pytest.fixture
def held() -> Reports:
    reports = Reports()
    reports.go_on(STANDS_S + 2 * EVERY_S, seen(QUEUE_S))
    assert reports.least_bps == SHARE * LINK_BPS
    return reports


def test_nothing_is_held_before_the_queue_has_stood_for_long() -> None:
    reports = Reports()
    reports.go_on(STANDS_S - EVERY_S, seen(QUEUE_S))
    assert not reports.share.is_held
    reports.go_on(3 * EVERY_S, seen(QUEUE_S))
    assert reports.share.is_held


def test_who_has_not_made_way_himself_holds_nothing() -> None:
    reports = Reports()
    reports.go_on(60, seen(0.3), budget_bps=0.3 * LINK_BPS)
    assert reports.least_bps == 0.0


def test_a_queue_of_our_own_that_drains_slowly_is_nobody_elses() -> None:
    reports = Reports()
    reports.go_on(60, seen(0.3), budget_bps=0.3 * LINK_BPS)
    reports.go_on(STANDS_S - EVERY_S, seen(0.2))
    assert not reports.share.is_held
    reports.go_on(3 * EVERY_S, seen(0.2))
    assert reports.share.is_held, "but it has stood for long now"


@given(st.lists(st.floats(0.1, STANDS_S - 0.2), min_size=1, max_size=8), st.floats(0.0, QUEUE_S - 1e-6))
def test_a_queue_that_drains_each_few_seconds_is_nobody_elses(stands_s: list[float], drained_s: float) -> None:
    reports = Reports()
    for stood_s in stands_s:
        reports.go_on(stood_s, seen(0.4))
        reports.go_on(EVERY_S, seen(drained_s))
    assert not reports.share.is_held


def test_it_is_let_go_for_a_moment_now_and_then(held: Reports) -> None:
    began_s, times = held.now_s, []
    for _ in range(600):
        held.go_on(EVERY_S, seen(0.3))
        times.append((held.now_s - began_s, held.least_bps > 0))
    kept_s = EVERY_S * sum(is_kept for _, is_kept in times)
    assert kept_s == pytest.approx(60 * HOLDS_S / (HOLDS_S + LETS_GO_S), abs=LETS_GO_S)
    assert all(is_kept for at_s, is_kept in times if at_s < HOLDS_S - 3 * EVERY_S)
    assert held.share.is_held


def test_where_the_queue_drains_nothing_is_held_any_more(held: Reports) -> None:
    held.go_on(EVERY_S, seen(DRAINED_S))
    assert held.share.is_held
    held.go_on(EVERY_S, seen(DRAINED_S - 1e-3))
    assert held.least_bps == 0.0
    held.go_on(STANDS_S - EVERY_S, seen(0.3))
    assert not held.share.is_held


def test_who_loses_much_holds_less_and_all_of_it_after_the_queue_has_drained(held: Reports) -> None:
    held.go_on(20, seen(0.3, lost=2))
    assert 0 < held.least_bps < SHARE / 2 * LINK_BPS
    held.go_on(EVERY_S, seen(0.0))
    held.go_on(40, seen(0.0))
    held.go_on(STANDS_S + 2 * EVERY_S, seen(0.3))
    assert held.least_bps == SHARE * LINK_BPS


def test_what_less_is_held_shows_its_effect_before_still_less_is(held: Reports) -> None:
    held.go_on(3.9, seen(0.3, lost=9))
    once = held.least_bps
    assert SHARE / 2 * LINK_BPS < once < SHARE * LINK_BPS
    held.go_on(2, seen(0.3, lost=9))
    assert once / 2 < held.least_bps < once


def test_the_few_percent_that_a_full_queue_costs_change_nothing(held: Reports) -> None:
    for _ in range(20):
        held.go_on(0.9, seen(0.3))
        held.go_on(EVERY_S, seen(0.3, lost=5))
    assert held.least_bps in (0.0, SHARE * LINK_BPS)


def test_the_last_known_speed_of_the_link_counts(held: Reports) -> None:
    held.go_on(1, seen(0.3, trains_bps=None))
    assert held.least_bps == SHARE * LINK_BPS
    held.go_on(EVERY_S, seen(0.3, trains_bps=LINK_BPS / 2))
    assert held.least_bps == SHARE * LINK_BPS / 2
