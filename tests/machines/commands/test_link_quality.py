"""Silence makes every measure worse, and nothing an operator sends makes the memory grow."""

from __future__ import annotations

import random
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.commands.link_quality import LOSS_WINDOW_S, MAX_GAP, MIN_COMMANDS, LinkQuality
from mosaic_core.machines.commands.slow_down import Measures

# -- round-trip time


def test_nothing_is_known_at_first() -> None:
    assert LinkQuality().measures(5.0) == Measures(None, None, None)


def test_the_latest_answer_is_the_round_trip_time() -> None:
    link = LinkQuality()
    link.pinged(1_000_000)
    link.ponged(1_000_000, 1.08)
    assert link.measures(9.0).rtt_ms == pytest.approx(80.0)
    link.pinged(9_000_000)
    link.ponged(9_000_000, 9.02)
    assert link.measures(9.1).rtt_ms == pytest.approx(20.0)


def test_an_unanswered_ping_counts_by_its_age() -> None:
    link = LinkQuality()
    link.pinged(1_000_000)
    assert link.measures(1.0).rtt_ms == 0.0
    assert link.measures(1.7).rtt_ms == pytest.approx(700.0)
    link.pinged(1_500_000)
    assert link.measures(2.0).rtt_ms == pytest.approx(1000.0), "the oldest one counts"


def test_a_new_ping_under_way_does_not_hide_the_latest_answer() -> None:
    link = LinkQuality()
    link.pinged(1_000_000)
    link.ponged(1_000_000, 1.3)
    link.pinged(2_000_000)
    assert link.measures(2.01).rtt_ms == pytest.approx(300.0)


def test_an_answer_settles_all_pings_before_it() -> None:
    link = LinkQuality()
    for t0_us in (1_000_000, 1_500_000, 2_000_000):
        link.pinged(t0_us)
    link.ponged(2_000_000, 2.05)
    assert link.measures(2.1).rtt_ms == pytest.approx(50.0)
    link.ponged(1_000_000, 2.2)
    assert link.measures(2.2).rtt_ms == pytest.approx(50.0), "too late to mean anything"


@pytest.mark.parametrize("t0_us", [0, -1, 999_999, 2**70])
def test_an_answer_to_no_ping_is_ignored(t0_us: int) -> None:
    link = LinkQuality()
    link.pinged(1_000_000)
    link.ponged(t0_us, 1.4)
    assert link.measures(1.5).rtt_ms == pytest.approx(500.0)


def test_a_peer_that_never_answers_is_silent_since_its_first_ping() -> None:
    link = LinkQuality()
    for number in range(10_000):
        link.pinged(number * 500_000)
    assert link.measures(5000.0).rtt_ms == pytest.approx(5_000_000.0)
    link.ponged(9_999 * 500_000, 5000.0)
    assert link.measures(5000.0).rtt_ms == pytest.approx(500.0), "the newest is remembered too"


# -- loss


def send(link: LinkQuality, numbers: list[int], start_s: float = 0.0, period_s: float = 0.02) -> float:
    now_s = start_s
    for number in numbers:
        now_s += period_s
        link.command_seen(number, now_s)
    return now_s


def test_without_gaps_there_is_no_loss_whatever_the_first_number() -> None:
    link = LinkQuality()
    end_s = send(link, [(2**32 - 25 + step) % 2**32 for step in range(50)])
    assert link.measures(end_s).loss == 0.0


def test_a_fifth_of_gaps_is_a_fifth_of_loss() -> None:
    link = LinkQuality()
    end_s = send(link, [number for number in range(100) if number % 5])
    assert link.measures(end_s).loss == pytest.approx(0.2, abs=0.02)


def test_an_overtaken_command_is_not_lost() -> None:
    link = LinkQuality()
    numbers = list(range(50))
    numbers[20], numbers[23] = numbers[23], numbers[20]
    assert link.measures(send(link, numbers)).loss == 0.0


def test_a_repeated_command_hides_no_loss() -> None:
    link = LinkQuality()
    numbers = [number for number in range(60) if number % 2]
    end_s = send(link, numbers + numbers[-20:] * 3, period_s=0.001)
    assert link.measures(end_s).loss == pytest.approx(0.5, abs=0.05)


def test_few_commands_say_nothing_about_loss() -> None:
    link = LinkQuality()
    end_s = send(link, [1, 5, 7])
    assert link.measures(end_s).loss is None
    end_s = send(link, list(range(8, 8 + MIN_COMMANDS)), end_s)
    assert link.measures(end_s).loss is not None


def test_loss_is_forgotten_with_its_window() -> None:
    link = LinkQuality()
    end_s = send(link, [number for number in range(50) if number % 2])
    assert link.measures(end_s).loss == pytest.approx(0.5, abs=0.05)
    assert link.measures(end_s + LOSS_WINDOW_S * 1.2).loss is None
    end_s = send(link, list(range(50, 170)), end_s)
    assert link.measures(end_s).loss == 0.0


def test_channels_count_their_numbers_each_for_itself() -> None:
    link = LinkQuality()
    for number in range(30):
        link.command_seen(number, 0.01 * number, "base")
        link.command_seen(7_000_000 + number, 0.01 * number, "arm")
    assert link.measures(0.3).loss == 0.0
    link.channel_closed("base")
    link.command_seen(123_456, 0.31, "base")
    assert link.measures(0.31).loss == 0.0, "a new channel of that name starts anew"


def test_a_leap_of_numbers_is_heavy_loss_and_nothing_worse() -> None:
    link = LinkQuality()
    link.command_seen(0, 0.0)
    link.command_seen(2**31 - 1, 0.1)
    loss = link.measures(0.1).loss
    assert loss is not None
    assert 0.99 < loss <= 1.0
    for number in range(MAX_GAP):
        link.command_seen(2**31 + number, 0.1)
    assert link.measures(0.1).loss == pytest.approx(0.5, abs=0.01)


@given(st.lists(st.tuples(st.integers(-(2**70), 2**70), st.floats(0, 0.5)), max_size=100))
def test_loss_is_a_share_whatever_arrives(arrivals: list[tuple[int, float]]) -> None:
    link, now_s = LinkQuality(), 0.0
    for seq, step_s in arrivals:
        now_s += step_s
        link.command_seen(seq, now_s)
        loss = link.measures(now_s).loss
        assert loss is None or 0.0 <= loss <= 1.0


@pytest.mark.parametrize("share", [0.0, 0.05, 0.2, 0.5])
def test_random_loss_is_measured_as_what_it_is(share: float) -> None:
    rng, link, measured, now_s = random.Random(1), LinkQuality(), [], 0.0
    for number in range(6000):
        now_s += 0.02
        if rng.random() >= share:
            link.command_seen(number, now_s)
        if number > 200 and number % 50 == 0:
            measured.append(link.measures(now_s).loss or 0.0)
    assert sum(measured) / len(measured) == pytest.approx(share, abs=0.02)


# -- the picture


def test_the_age_of_the_picture_grows_until_a_newer_one_is_shown() -> None:
    link = LinkQuality()
    link.picture_seen("front", 10.0, 10.12)
    assert link.measures(10.12).picture_ms == pytest.approx(120.0)
    assert link.measures(11.0).picture_ms == pytest.approx(1000.0)
    link.picture_seen("front", 10.95, 11.05)
    assert link.measures(11.05).picture_ms == pytest.approx(100.0)


def test_the_freshest_picture_of_all_counts() -> None:
    link = LinkQuality()
    link.picture_seen("front", 10.0, 10.1)
    link.picture_seen("rear", 10.4, 10.5)
    assert link.measures(10.5).picture_ms == pytest.approx(100.0)


def test_who_watches_but_sees_nothing_has_a_picture_that_grows_old() -> None:
    link = LinkQuality()
    link.picture_seen("front", None, 10.0)
    link.picture_seen("front", None, 10.5)
    assert link.measures(11.0).picture_ms == pytest.approx(1000.0)


def test_a_picture_that_went_black_keeps_its_age() -> None:
    link = LinkQuality()
    link.picture_seen("front", 9.9, 10.0)
    link.picture_seen("front", None, 10.5)
    assert link.measures(10.5).picture_ms == pytest.approx(600.0)


def test_a_picture_from_the_future_is_as_old_as_its_report() -> None:
    link = LinkQuality()
    link.picture_seen("front", 1e18, 10.0)
    assert link.measures(11.0).picture_ms == pytest.approx(1000.0)


def test_an_older_report_does_not_make_the_picture_older() -> None:
    link = LinkQuality()
    link.picture_seen("front", 10.0, 10.1)
    link.picture_seen("front", 9.0, 10.2)
    assert link.measures(10.2).picture_ms == pytest.approx(200.0)


def test_a_picture_that_is_no_longer_watched_counts_no_more() -> None:
    link = LinkQuality()
    link.picture_seen("front", 10.0, 10.1)
    link.picture_unwatched("front")
    link.picture_unwatched("never seen")
    assert link.measures(99.0).picture_ms is None


# -- hostile peers


def test_thousands_of_channels_labels_and_pings_take_no_more_memory_than_some() -> None:
    def size(count: int) -> int:
        link = LinkQuality()
        for number in range(count):
            link.picture_seen(f"label {number}", float(number), float(number))
            link.command_seen(number * 7919, float(number), f"channel {number}")
            link.pinged(number)
            link.ponged(-number, float(number))
        return sum(sys.getsizeof(value) for value in vars(link).values())

    assert size(20_000) == size(200)


ACTIONS = st.one_of(
    st.tuples(st.just("ping"), st.integers(-(2**66), 2**66)),
    st.tuples(st.just("pong"), st.integers(-(2**66), 2**66)),
    st.tuples(st.just("command"), st.integers(-(2**66), 2**66)),
    st.tuples(st.just("picture"), st.one_of(st.none(), st.floats(allow_nan=False))),
)


@given(st.lists(st.tuples(ACTIONS, st.floats(0, 1e6)), max_size=60))
def test_no_sequence_of_absurd_values_raises(walk: list[tuple[tuple[str, float | int | None], float]]) -> None:
    link, now_s = LinkQuality(), 0.0
    for (what, value), step_s in walk:
        now_s += step_s
        if what == "picture":
            link.picture_seen("front", value, now_s)
        elif isinstance(value, int):
            if what == "ping":
                link.pinged(value)
            elif what == "pong":
                link.ponged(value, now_s)
            else:
                link.command_seen(value, now_s)
        measures = link.measures(now_s)
        assert measures.rtt_ms is None or measures.rtt_ms >= 0.0
        assert measures.picture_ms is None or measures.picture_ms >= 0.0


@given(st.lists(st.floats(0, 5), min_size=1, max_size=20))
def test_while_nothing_arrives_nothing_gets_better(steps: list[float]) -> None:
    link = LinkQuality()
    link.pinged(0)
    link.ponged(0, 0.1)
    link.pinged(500_000)
    link.picture_seen("front", 0.3, 0.5)
    now_s, rtt_ms, picture_ms = 0.5, 0.0, 0.0
    for step_s in steps:
        now_s += step_s
        measures = link.measures(now_s)
        assert measures.rtt_ms is not None
        assert measures.picture_ms is not None
        assert measures.rtt_ms >= rtt_ms
        assert measures.picture_ms >= picture_ms
        rtt_ms, picture_ms = measures.rtt_ms, measures.picture_ms
