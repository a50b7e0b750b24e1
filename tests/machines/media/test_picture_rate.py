"""The rate of a source's pictures, whatever happens to single ones."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.media.picture_rate import PictureRate


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
