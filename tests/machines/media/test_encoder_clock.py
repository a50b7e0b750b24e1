"""An encoder's clock: it runs as fast as the bit rate that is aimed at, and saves up nothing."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.media.encoder_clock import FEWEST, MOST, EncoderClock

INTERVAL = 4_500


def test_at_the_bit_rate_that_it_began_at_the_clock_runs_as_ours() -> None:
    clock = EncoderClock(500_000)
    times = [clock.at(1_000 + number * INTERVAL, None) for number in range(5)]
    assert [late - early for early, late in pairwise(times)] == [INTERVAL] * 4


@given(st.integers(50_000, 1_000_000), st.floats(FEWEST, MOST))
def test_a_picture_is_given_the_time_that_its_bits_need(began_bps: int, share: float) -> None:
    clock = EncoderClock(began_bps)
    clock.at(0, INTERVAL)
    clock.bitrate_bps = round(share * began_bps)
    last = [clock.at(number * INTERVAL, INTERVAL) for number in range(1, 101)][-1]
    assert last == pytest.approx(100 * INTERVAL * share, rel=0.01)


@given(st.lists(st.integers(-10, 500_000), min_size=2, max_size=30), st.integers(1, 2_000_000))
def test_the_encoders_time_always_rises(steps: list[int], aimed_bps: int) -> None:
    clock, ticks, before = EncoderClock(1_000_000), 0, 0
    clock.bitrate_bps = aimed_bps
    for step in steps:
        ticks += step
        own = clock.at(ticks, INTERVAL)
        assert own > before
        before = own


def test_times_begin_at_one_and_pictures_of_one_moment_are_one_apart() -> None:
    clock = EncoderClock(500_000)
    clock.bitrate_bps = 1_000_000
    assert not clock.has_begun
    assert [clock.at(7_000, INTERVAL) for _ in range(3)] == [1, 2, 3]
    assert clock.has_begun


def test_a_pause_saves_up_no_bits() -> None:
    clock = EncoderClock(500_000)
    before = clock.at(0, INTERVAL)
    assert clock.at(100 * INTERVAL, INTERVAL) - before == 1.5 * INTERVAL
    clock = EncoderClock(500_000)
    before = clock.at(0, None)
    assert clock.at(100 * INTERVAL, None) - before == 100 * INTERVAL, "what is usual isn't known yet"


@pytest.mark.parametrize(
    ("wanted_bps", "nearest_bps"),
    [(1, 83_334), (83_334, 83_334), (90_000, 90_000), (2_000_000, 2_000_000), (2_000_001, 2_000_000)],
)
def test_how_far_it_reaches(wanted_bps: int, nearest_bps: int) -> None:
    assert EncoderClock(1_000_000).nearest_bps(wanted_bps) == nearest_bps
