"""What is paced keeps its rate over any history, and what must arrive arrives."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.timing.pacing import (
    BURST_S,
    COMPLAINT_PERIOD_S,
    ComplaintPace,
    GridThinning,
    NewestThinning,
    PictureRate,
    TimeShare,
    TokenBucket,
)

CREDIT_S = 0.001


def test_commands_at_the_rate_all_pass() -> None:
    bucket = TokenBucket.of_rate(50.0)
    assert all(bucket.admits(tick * 0.02) for tick in range(1000))


def test_twice_the_rate_is_halved() -> None:
    bucket = TokenBucket.of_rate(50.0)
    passed = sum(bucket.admits(tick * 0.01) for tick in range(1000))
    assert passed == pytest.approx(500 + 50 * BURST_S, abs=2)


def test_what_a_network_held_back_passes_at_once() -> None:
    bucket = TokenBucket.of_rate(40.0)
    assert [bucket.admits(1.0) for _ in range(12)] == [True] * 10 + [False] * 2


def test_a_clock_that_goes_back_gives_nothing() -> None:
    bucket = TokenBucket.of_rate(4.0)
    while bucket.admits(10.0):
        pass
    assert not bucket.admits(-1e9)
    assert not bucket.admits(10.0)
    assert bucket.admits(10.25)


@pytest.mark.parametrize("paced", [TokenBucket.of_rate, NewestThinning, GridThinning])
@pytest.mark.parametrize("rate_hz", [0.0, -1.0, float("nan")])
def test_a_rate_must_be_positive(paced: Callable[[float], object], rate_hz: float) -> None:
    with pytest.raises(ValueError, match="positive"):
        paced(rate_hz)


@given(st.lists(st.tuples(st.floats(0, 2), st.floats(1, 12)), max_size=200))
def test_what_costs_more_is_paid_for_and_never_more_than_burst_plus_rate_passes(
    asked: list[tuple[float, float]],
) -> None:
    bucket, now_s, paid = TokenBucket(10, 20), 0.0, 0.0
    for pause_s, tokens in asked:
        now_s += pause_s
        paid += tokens * bucket.admits(now_s, tokens)
        assert paid <= 20 + 10 * now_s + 1e-6


def test_what_costs_more_than_is_left_is_refused_and_costs_nothing() -> None:
    bucket = TokenBucket(1, 10)
    assert [bucket.admits(0.0, tokens) for tokens in (6, 5, 4, 1)] == [True, False, True, False]


@given(st.floats(0.5, 500), st.lists(st.floats(0, 0.2), max_size=200))
def test_over_any_history_never_more_than_rate_and_burst(rate: float, steps: list[float]) -> None:
    bucket, now_s, passed = TokenBucket.of_rate(rate), 0.0, 0
    for step_s in steps:
        now_s += step_s
        passed += bucket.admits(now_s)
        assert passed <= now_s * rate + max(2.0, rate * BURST_S) + 1e-6


def test_the_first_goes_at_once_and_the_newest_of_a_period_when_it_is_over() -> None:
    it: NewestThinning[str] = NewestThinning(10.0)
    assert it.offer("a", 0.0) == "a"
    assert it.due_at_s is None
    assert it.offer("b", 0.03) is None
    assert it.offer("c", 0.06) is None
    assert it.due_at_s == pytest.approx(0.1)
    assert it.due(0.09) is None
    assert it.due(0.1) == "c"
    assert it.thinned == 1
    assert it.due(0.2) is None


def test_a_value_that_comes_when_the_kept_one_is_due_takes_its_place() -> None:
    it: NewestThinning[str] = NewestThinning(10.0)
    it.offer("a", 0.0)
    it.offer("b", 0.05)
    assert it.offer("c", 0.11) == "c"
    assert (it.due(0.2), it.thinned) == (None, 1)


def test_a_timer_that_is_a_little_late_does_not_lower_the_rate() -> None:
    it: NewestThinning[int] = NewestThinning(10.0)
    now_s, out = 0.0, 0
    for number in range(1000):
        now_s = number * 0.01 + 0.004
        out += (it.offer(number, now_s) is not None) + (it.due(now_s + 0.003) is not None)
    assert 99 <= out <= 101


@given(
    gaps_s=st.lists(st.floats(0, 0.3), min_size=1, max_size=80),
    rate_hz=st.floats(0.5, 50),
    lateness_s=st.floats(0, 0.02),
)
def test_however_values_come_the_rate_is_kept_and_the_newest_is_the_last_to_go(
    gaps_s: list[float], rate_hz: float, lateness_s: float
) -> None:
    it: NewestThinning[int] = NewestThinning(rate_hz)
    out: list[tuple[float, int]] = []
    now_s = 0.0

    def wait_until(until_s: float) -> None:
        """The driver's timer, which may be late."""
        due_at_s = it.due_at_s
        if due_at_s is not None and due_at_s + lateness_s <= until_s:
            value = it.due(due_at_s + lateness_s)
            assert value is not None
            out.append((due_at_s + lateness_s, value))

    for number, gap_s in enumerate(gaps_s):
        wait_until(now_s + gap_s)
        now_s += gap_s
        value = it.offer(number, now_s)
        if value is not None:
            assert value == number
            out.append((now_s, value))
    wait_until(float("inf"))
    sent = [value for _, value in out]
    assert sent == sorted(sent)
    assert sent[-1] == len(gaps_s) - 1
    assert len(sent) + it.thinned == len(gaps_s)
    for first, (at_s, _) in enumerate(out):
        for last in range(first + 1, len(out)):
            assert (last - first - 1) / rate_hz <= out[last][0] - at_s + 1e-6


def taken(fps: float, times: list[float]) -> list[float]:
    thinning = GridThinning(fps)
    return [at_s for at_s in times if thinning.takes(at_s)]


@given(wanted=st.floats(1, 60), given_fps=st.floats(60, 120))
def test_the_mean_rate_is_the_wanted_one(wanted: float, given_fps: float) -> None:
    shown = taken(wanted, [n / given_fps for n in range(round(10 * given_fps))])
    assert len(shown) == pytest.approx(10 * wanted, abs=2)


def test_a_source_of_the_wanted_rate_that_jitters_loses_nothing() -> None:
    jitter = np.random.default_rng(0).uniform(-0.006, 0.006, 300)
    times = [float(n / 30 + early) for n, early in enumerate(jitter)]
    assert len(taken(30, times)) >= 298


def test_after_a_gap_there_is_no_burst() -> None:
    shown = taken(10, [0.0, 5.0, 5.01, 5.02, 5.1])
    assert shown == [0.0, 5.0, 5.1]


def test_the_first_complaint_is_said_and_again_once_the_period_is_over() -> None:
    pace = ComplaintPace()
    assert [pace.is_due("scan", at_s) for at_s in (5.0, 5.0, 5.0 + COMPLAINT_PERIOD_S - 0.1)] == [True, False, False]
    assert pace.is_due("pose", 6.0)
    assert pace.is_due("scan", 5.0 + COMPLAINT_PERIOD_S)


@given(st.lists(st.floats(0, 100), max_size=60).map(sorted), st.floats(0.1, 50))
def test_between_two_of_one_kind_lies_a_period_and_silence_is_never_longer_than_needed(
    at_s: list[float], period_s: float
) -> None:
    pace = ComplaintPace(period_s)
    said = [now_s for now_s in at_s if pace.is_due("scan", now_s)]
    assert said[:1] == at_s[:1]
    assert all(later - earlier >= period_s for earlier, later in pairwise(said))
    for now_s in at_s:
        assert any(one <= now_s and now_s - one < period_s for one in said)


def test_work_that_begins_need_not_wait() -> None:
    assert TimeShare(0.5, CREDIT_S).wait_s(5.0) == 0


def test_what_was_taken_is_paid_back_in_proportion() -> None:
    share = TimeShare(0.25, CREDIT_S)
    share.took(10.0, 10.01)
    assert share.wait_s(10.01) == pytest.approx(0.04 - 0.01 - CREDIT_S)
    assert share.wait_s(10.05) == 0


def test_idleness_earns_nothing() -> None:
    share = TimeShare(0.5, CREDIT_S)
    share.took(0.0, 0.1)
    share.took(100.0, 100.1)
    assert share.wait_s(100.1) == pytest.approx(0.1 - CREDIT_S)


@given(
    st.lists(st.floats(min_value=1e-5, max_value=2e-3), min_size=1, max_size=60), st.sampled_from([0.2, 0.4, 0.5, 0.9])
)
def test_greedy_work_gets_its_share_and_one_credit(lengths_s: list[float], part: float) -> None:
    share, now_s = TimeShare(part, CREDIT_S), 0.0
    for length_s in lengths_s:
        now_s += share.wait_s(now_s)
        share.took(now_s, now_s + length_s)
        now_s += length_s
    worked_s, longest_s = sum(lengths_s), max(lengths_s)
    slack_s = 1e-9
    assert worked_s <= part * now_s + longest_s + CREDIT_S + slack_s
    assert worked_s >= part * (now_s - CREDIT_S) - slack_s or now_s <= worked_s + slack_s


def seen(times_s: list[float]) -> PictureRate:
    rate = PictureRate()
    for time_s in times_s:
        rate.seen(time_s)
    return rate


def test_a_few_pictures_tell_nothing_yet() -> None:
    assert seen([0.0, 0.1, 0.2, 0.3]).fps is None


def test_left_out_pictures_and_pauses_do_not_move_it() -> None:
    times_s = [index / 30 for index in range(20) if index not in (7, 8, 15)] + [100.0, 100.0, 99.0]
    assert seen(times_s).fps == pytest.approx(30, rel=0.01)


def test_a_source_that_becomes_slower_is_followed() -> None:
    times_s = [index / 30 for index in range(30)] + [1 + index / 10 for index in range(1, 12)]
    assert seen(times_s).fps == pytest.approx(10, rel=0.01)


@given(st.lists(st.floats(min_value=-1e6, max_value=1e6), max_size=40))
def test_no_sequence_of_times_makes_it_senseless(times_s: list[float]) -> None:
    fps = seen(times_s).fps
    assert fps is None or fps >= 0.5
