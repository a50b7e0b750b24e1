"""The time line of a recording."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_recorder.timeline import LEAST_STEP_S, USUAL_STEP_S, Timeline

TIMES_S = st.floats(0.0, 1e6)


def test_it_begins_at_zero_and_keeps_the_distances_of_the_captures() -> None:
    line = Timeline()
    assert [line.place(at_s) for at_s in (100.0, 100.1, 100.3)] == pytest.approx([0.0, 0.1, 0.3])
    assert line.end_s == pytest.approx(0.45)  # the last one is shown as long as is usual: the median


def test_a_hiccup_is_not_usual() -> None:
    line = Timeline()
    for at_s in (0.0, 0.1, 0.2, 0.3, 0.9):
        line.place(at_s)
    assert line.end_s == pytest.approx(1.0)


def test_nothing_recorded_is_no_time() -> None:
    assert Timeline().end_s == 0.0


def test_a_single_picture_is_shown_for_a_usual_time() -> None:
    line = Timeline()
    line.place(7.0)
    assert line.end_s == USUAL_STEP_S


def test_a_gap_in_the_pictures_stays_a_gap() -> None:
    line = Timeline()
    line.place(0.0)
    assert line.place(5.0) == 5.0


def test_a_cut_is_left_out_and_the_next_picture_follows_at_the_usual_distance() -> None:
    line = Timeline()
    for at_s in (10.0, 10.1, 10.2):
        line.place(at_s)
    line.cut()
    assert line.place(500.0) == pytest.approx(0.3)
    assert line.place(500.1) == pytest.approx(0.4)


def test_cutting_before_the_first_picture_or_twice_changes_nothing() -> None:
    line = Timeline()
    line.cut()
    assert line.place(3.0) == 0.0
    line.cut()
    line.cut()
    assert line.place(9.0) == pytest.approx(USUAL_STEP_S)


@given(st.lists(st.one_of(TIMES_S, st.none()), max_size=30))
def test_times_always_rise_and_a_look_ahead_is_right(steps: list[float | None]) -> None:
    line, placed = Timeline(), []
    for step in steps:
        if step is None:
            line.cut()
            continue
        expected = (line.peek(step), line.end_with(step))
        placed.append(line.place(step))
        assert (placed[-1], line.end_s) == expected
        assert line.end_s > placed[-1]
    assert all(later - earlier > LEAST_STEP_S * 0.99 for earlier, later in pairwise(placed))


@given(st.lists(TIMES_S, min_size=1, max_size=30, unique=True).map(sorted))
def test_without_cuts_a_picture_is_where_it_was_captured(times_s: list[float]) -> None:
    line = Timeline()
    late_s = 0.0
    for before_s, at_s in pairwise([times_s[0], *times_s]):
        late_s = max(0.0, late_s + LEAST_STEP_S - (at_s - before_s)) if line.end_s else 0.0
        assert line.place(at_s) == pytest.approx(at_s - times_s[0] + late_s, abs=1e-6)
