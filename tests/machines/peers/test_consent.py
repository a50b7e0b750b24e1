"""A peer that is gone is lost after a bounded silence, and one that lives never."""

from __future__ import annotations

from itertools import cycle

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.peers.consent import ASK_PERIOD_S, CONSENT_S, LOST_AFTER_S, TICK_S, Consent

FREED_WITHIN_S = 16.0


def walked(it: Consent, from_s: float, until_s: float, unit: float = 0.5) -> list[tuple[float, str]]:
    """Tick from one moment to another; every step but ``wait``, with its time."""
    now_s, steps = from_s, []
    while now_s < until_s:
        now_s += it.pause_s(now_s, unit)
        step = it.tick(now_s)
        if step != "wait":
            steps.append((now_s, step))
        if step == "lost":
            break
    return steps


def test_ticks_are_spread_by_a_fifth_either_way() -> None:
    it = Consent(0.0)
    assert [it.pause_s(0.0, unit) for unit in (0.0, 0.5, 1.0)] == pytest.approx([0.8 * TICK_S, TICK_S, 1.2 * TICK_S])


@pytest.mark.parametrize("unit", [0.0, 0.5, 0.999])
def test_a_peer_that_vanishes_is_asked_ten_times_and_then_lost_within_the_bound(unit: float) -> None:
    it = Consent(0.0)
    steps = walked(it, 0.0, 60.0, unit)
    lost_at_s, last = steps[-1]
    assert last == "lost"
    assert LOST_AFTER_S <= lost_at_s < FREED_WITHIN_S
    assert len(steps) > 8


def test_a_peer_that_is_silent_and_answers_is_asked_seldom_and_kept_for_good() -> None:
    it, now_s, asked = Consent(0.0), 0.0, 0
    while now_s < 600.0:
        now_s += it.pause_s(now_s, 0.5)
        step = it.tick(now_s)
        assert step != "lost"
        if step == "ask":
            asked += 1
            it.answered(now_s + 0.1)
    assert asked < 600.0 / 2


def test_a_peer_that_sends_all_the_time_is_asked_no_more_often_than_the_standard_says() -> None:
    it, now_s, asked = Consent(0.0), 0.0, 0
    while now_s < 100.0:
        now_s += it.pause_s(now_s, 0.5)
        it.heard(now_s)
        if it.tick(now_s) == "ask":
            asked += 1
            it.answered(now_s)
    assert asked <= 100.0 / ASK_PERIOD_S


@pytest.mark.parametrize("stalls_at_s", [30.0, 30.7, 31.4, 32.1, 32.8])
def test_a_stall_of_ten_seconds_costs_a_silent_peer_nothing_whenever_it_begins(stalls_at_s: float) -> None:
    it, now_s = Consent(0.0), 0.0
    while now_s < 100.0:
        now_s += it.pause_s(now_s, 0.99)
        step = it.tick(now_s)
        assert step != "lost"
        if step == "ask" and not stalls_at_s < now_s < stalls_at_s + 10.0:
            it.answered(now_s)


def test_a_stall_that_is_shorter_than_the_bound_costs_nothing() -> None:
    it = Consent(0.0)
    assert "lost" not in [step for _, step in walked(it, 0.0, LOST_AFTER_S - TICK_S)]
    it.heard(LOST_AFTER_S - 0.1)
    assert "lost" not in [step for _, step in walked(it, LOST_AFTER_S - 0.1, 2 * LOST_AFTER_S - 1.5)]


def test_whoever_sends_and_never_answers_has_taken_back_its_consent() -> None:
    it, now_s, step = Consent(0.0), 0.0, ""
    while step != "lost":
        now_s += it.pause_s(now_s, 0.5)
        it.heard(now_s)
        step = it.tick(now_s)
    assert now_s == pytest.approx(CONSENT_S, abs=TICK_S)


def test_when_our_own_process_stood_still_what_waits_unread_gets_its_chance() -> None:
    it = Consent(0.0)
    it.pause_s(0.0, 0.5)
    assert it.tick(60.0) == "ask"
    it.answered(60.1)
    assert "lost" not in [step for _, step in walked(it, 60.1, 70.0)]
    gone = Consent(0.0)
    gone.pause_s(0.0, 0.5)
    gone.tick(60.0)
    assert walked(gone, 60.0, 70.0)[-1][1] == "lost", "a stall of ours is no excuse for ever"


@given(st.lists(st.floats(0.05, LOST_AFTER_S - 1.3), min_size=1, max_size=8), st.lists(st.floats(0, 0.99), min_size=1))
def test_whatever_the_gaps_a_peer_that_is_heard_and_answers_when_asked_later_is_kept(
    gaps_s: list[float], units: list[float]
) -> None:
    it, now_s, heard_at_s, gaps = Consent(0.0), 0.0, 0.0, cycle(gaps_s)
    gap_s = next(gaps)
    for unit in [*units, *units] * 10:
        now_s += it.pause_s(now_s, unit)
        while heard_at_s + gap_s <= now_s:
            heard_at_s += gap_s
            gap_s = next(gaps)
            it.answered(heard_at_s)
        assert it.tick(now_s) != "lost"
