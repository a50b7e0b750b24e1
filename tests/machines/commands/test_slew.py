"""How far a vector may go in one step: never too far, never held back without need, and whatever its unit."""

from __future__ import annotations

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from mosaic_core.machines.commands.slew import MAX_RISE_STEP_S, clamped, reach
from mosaic_core.words.limits import FieldLimit

FIELDS = ("x", "y")
SPEEDS = st.one_of(st.just(0.0), st.floats(0.001, 3.0), st.floats(-3.0, -0.001))
VECTORS = st.tuples(SPEEDS, SPEEDS)
RATES = st.one_of(st.none(), st.floats(0.01, 50.0))
TIMES = st.one_of(st.just(0.0), st.floats(0.001, 2.0))
UNITS = st.sampled_from([2.0**-30, 1.0, 2.0**30])


def share(last: tuple[float, float], target: tuple[float, float], rise: float | None, fall: float | None,
          elapsed_s: float, unit: float = 1.0) -> float:  # fmt: skip
    """Of the way, with every length in another unit."""
    rates = [None if rate is None else rate * unit for rate in (rise, fall)]
    limit = FieldLimit(FIELDS, None, None, None, *rates)
    return reach([value * unit for value in last], [value * unit for value in target], limit, (0, 1), elapsed_s)


@given(VECTORS, VECTORS, RATES, RATES, TIMES)
def test_it_goes_some_of_the_way_and_never_more_than_all(
    last: tuple[float, float], target: tuple[float, float], rise: float | None, fall: float | None, elapsed_s: float
) -> None:
    assert 0.0 <= share(last, target, rise, fall, elapsed_s) <= 1.0


@given(VECTORS, VECTORS, RATES, RATES, TIMES, UNITS)
def test_the_unit_of_a_field_makes_no_difference(
    last: tuple[float, float], target: tuple[float, float], rise: float | None, fall: float | None, elapsed_s: float,
    unit: float,
) -> None:  # fmt: skip
    assert share(last, target, rise, fall, elapsed_s, unit) == share(last, target, rise, fall, elapsed_s)


@given(VECTORS, VECTORS, TIMES)
def test_what_nothing_limits_goes_all_the_way(
    last: tuple[float, float], target: tuple[float, float], elapsed_s: float
) -> None:
    assert share(last, target, None, None, elapsed_s) == 1.0


@given(VECTORS, st.floats(0.0, 0.999), RATES)
def test_no_fall_is_held_back_by_how_fast_it_may_rise(
    last: tuple[float, float], part: float, rise: float | None
) -> None:
    """Straight towards zero nothing rises, whatever is rounded on the way, and also in no time."""
    x, y = last
    assert share(last, (x * part, y * part), rise, None, 0.0) == 1.0


@given(VECTORS, st.floats(1.001, 3.0), st.floats(0.01, 50.0), TIMES)
def test_no_rise_is_held_back_by_how_fast_it_may_fall(
    last: tuple[float, float], part: float, fall: float, elapsed_s: float
) -> None:
    x, y = last
    assert share(last, (x * part, y * part), None, fall, elapsed_s) == 1.0


@given(VECTORS, st.floats(0.01, 50.0), st.floats(0.0, 1.0))
def test_from_zero_it_rises_by_its_rate(target: tuple[float, float], rise: float, part: float) -> None:
    length = math.hypot(*target)
    assume(length > 0.0)
    elapsed_s = part * MAX_RISE_STEP_S
    assert share((0.0, 0.0), target, rise, None, elapsed_s) == pytest.approx(min(1.0, elapsed_s * rise / length))


def test_what_has_had_its_time_is_there() -> None:
    assert share((1.0, 0.0), (0.0, 0.0), None, 2.0, 0.5) == 1.0
    assert share((0.0, 0.0), (0.125, 0.0), 2.0, None, 0.0625) == 1.0


@given(VECTORS)
def test_a_vector_as_long_as_allowed_is_left_as_it_is(vector: tuple[float, float]) -> None:
    values = list(vector)
    clamped(values, FieldLimit(FIELDS, None, None, math.hypot(*vector)), (0, 1))
    assert values == list(vector)
