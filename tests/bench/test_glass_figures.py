"""What the bench says of displayed pictures, on lists whose answer is known."""

from __future__ import annotations

import math
from typing import Any

import pytest
from glass_bench.figures import (
    Displayed,
    drift_ms,
    freezes_per_minute,
    mean_bps,
    rank,
    rate_reached_s,
    well_again_s,
)
from glass_bench.page import PageClock, displayed
from hypothesis import given
from hypothesis import strategies as st

from mosaic_camera.marks import TICK_S, WRAP


def film(from_s: float, to_s: float, age_s: float, period_s: float = 1 / 32) -> list[Displayed]:
    count = round((to_s - from_s) / period_s)
    return [Displayed(from_s + number * period_s, age_s, 480) for number in range(count)]


def test_a_rank_is_one_of_the_values() -> None:
    assert rank([3.0, 1.0, 2.0], 0.5) == 2.0
    assert rank([3.0, 1.0, 2.0], 0.95) == 3.0
    assert math.isnan(rank([], 0.5))


def test_fluid_pictures_have_no_freezes_and_do_not_drift() -> None:
    pictures = film(0, 10, 0.05)
    assert freezes_per_minute(pictures, 0, 10) == 0
    assert drift_ms(pictures) == pytest.approx(0)


def test_a_gap_in_the_middle_and_one_at_the_end_are_freezes() -> None:
    pictures = [*film(0, 4, 0.05), *film(5, 9, 0.05)]
    assert freezes_per_minute(pictures, 0, 10) == 12


def test_no_picture_at_all_is_a_freeze() -> None:
    assert freezes_per_minute([], 0, 60) == 1


def test_ages_that_grow_are_a_drift() -> None:
    pictures = [Displayed(at_s, 0.05 + at_s / 100, 480) for at_s in range(60)]
    assert drift_ms(pictures) == pytest.approx(400)


def test_a_picture_is_well_again_when_it_stays_young() -> None:
    pictures = [*film(0, 3, 0.5), *film(3, 4, 0.05), *film(4, 5, 0.5), *film(5, 10, 0.05)]
    assert well_again_s(pictures, 0, 10, 150) == pytest.approx(5, abs=0.1)
    assert well_again_s(pictures, 0, 6, 150) == math.inf


def test_freezing_pictures_are_not_well_however_young() -> None:
    assert well_again_s(film(0, 10, 0.05, period_s=0.25), 0, 10, 150) == math.inf


def test_a_bit_rate_is_regained_when_it_came_for_two_seconds() -> None:
    arrived = [(tenth / 10, 12_500 * tenth if tenth < 50 else 625_000 + 50_000 * (tenth - 50)) for tenth in range(100)]
    assert rate_reached_s(arrived, 0, 3.9e6) == pytest.approx(7, abs=0.2)
    assert rate_reached_s(arrived, 0, 5e6) == math.inf
    assert mean_bps(arrived, 0, 5) == pytest.approx(1e6)


@given(at_s=st.floats(0, 2 * WRAP * TICK_S), age_s=st.floats(-1, 3600))
def test_an_age_is_right_also_where_the_marks_wrap(at_s: float, age_s: float) -> None:
    ticks = round((at_s - age_s) / TICK_S) % WRAP
    assert PageClock(0.0, 0.0).age_s(ticks, at_s) == pytest.approx(age_s, abs=2 * TICK_S)


def test_pixels_of_the_next_picture_do_not_count_for_this_one() -> None:
    clock = PageClock(offset_s=100.0, error_s=0.0)
    samples: list[list[Any]] = [
        [1000.0, 7, 1_009_500, 480, None],
        [1033.0, 9, 1_010_000, 480, 40.0],
        [1066.0, 9, 1_010_000, 480, 30.0],
    ]
    first, early, own = displayed(samples, clock)
    assert first.age_s == pytest.approx(0.05)
    assert early.age_s is None
    assert own.age_s == pytest.approx(0.066)
    assert own.told_age_s == pytest.approx(0.03)


def test_marks_that_could_not_be_read_give_no_age() -> None:
    assert displayed([[0.0, None, None, 480, None]], PageClock(0.0, 0.0))[0].age_s is None
