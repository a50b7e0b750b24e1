"""The worse the link, the slower; and whoever drives hears of it, but not too often."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.commands.slow_down import (
    REPORT_PERIOD_S,
    Cause,
    LimitReport,
    Measures,
    link_factor,
    on_curve,
    picture_factor,
    slow_down,
)
from mosaic_core.words.limits import NO_SLOW_DOWN, Curve, PictureRule, SlowDownCurves

DEFAULTS = SlowDownCurves()
FALLING: Curve = ((100.0, 1.0), (200.0, 0.5), (400.0, 0.0))


@pytest.mark.parametrize(
    ("value", "factor"),
    [(-1e9, 1.0), (0, 1.0), (100, 1.0), (150, 0.75), (200, 0.5), (300, 0.25), (400, 0.0), (1e9, 0.0), (math.inf, 0.0)],
)
def test_a_curve_is_linear_between_its_points_and_flat_outside(value: float, factor: float) -> None:
    assert on_curve(FALLING, value) == pytest.approx(factor)


def test_what_is_no_number_slows_down_most() -> None:
    assert on_curve(FALLING, math.nan) == 0.0


def test_a_curve_of_one_point_is_a_constant() -> None:
    assert [on_curve(((100.0, 0.3),), value) for value in (0, 100, 200)] == [0.3, 0.3, 0.3]


def test_a_good_link_limits_nothing() -> None:
    assert slow_down(DEFAULTS, Measures(40.0, 0.0, 120.0)) == (1.0, ())


def test_an_unknown_link_limits_nothing_yet() -> None:
    assert slow_down(DEFAULTS, Measures()) == (1.0, ())


def test_the_worst_cause_decides_and_comes_first() -> None:
    factor, causes = slow_down(DEFAULTS, Measures(300.0, 0.2, 1500.0))
    assert factor == 0.0
    assert [(cause.cause, cause.factor) for cause in causes] == [("picture", 0.0), ("loss", 0.5), ("rtt", 0.6)]
    assert causes[0] == Cause("picture", 1500.0, 0.0)


@pytest.mark.parametrize(
    ("measures", "left"),
    [
        (Measures(), 1.0),
        (Measures(rtt_ms=300.0), 0.6),
        (Measures(loss=0.2), 0.5),
        (Measures(rtt_ms=300.0, loss=0.2), 0.5),
        (Measures(picture_ms=1500.0), 1.0),
    ],
)
def test_of_a_link_the_worse_of_round_trip_and_loss_counts(measures: Measures, left: float) -> None:
    assert link_factor(DEFAULTS, measures) == pytest.approx(left)


@pytest.mark.parametrize(
    ("rule", "picture_ms", "left"),
    [
        ("off", None, 1.0),
        ("off", 1500.0, 1.0),
        ("if_watching", None, 1.0),
        ("if_watching", 1500.0, 0.0),
        ("required", None, 0.0),
        ("required", 120.0, 1.0),
    ],
)
def test_the_age_of_the_picture_counts_by_its_rule(rule: PictureRule, picture_ms: float | None, left: float) -> None:
    curves = replace(DEFAULTS, picture=rule)
    assert picture_factor(curves, Measures(300.0, 0.2, picture_ms)) == left


def test_a_frozen_picture_is_a_standstill() -> None:
    assert slow_down(DEFAULTS, Measures(picture_ms=1000.0))[0] == 0.0


@pytest.mark.parametrize(
    ("rule", "picture_ms", "factor"),
    [
        ("if_watching", None, 1.0),
        ("if_watching", 2000.0, 0.0),
        ("required", None, 0.0),
        ("required", 100.0, 1.0),
        ("off", None, 1.0),
        ("off", 2000.0, 1.0),
    ],
)
def test_the_rule_of_the_picture(rule: PictureRule, picture_ms: float | None, factor: float) -> None:
    assert slow_down(SlowDownCurves(picture=rule), Measures(picture_ms=picture_ms))[0] == factor


def test_a_required_picture_that_is_not_there_is_a_cause_without_a_value() -> None:
    assert slow_down(SlowDownCurves(picture="required"), Measures())[1] == (Cause("picture", None, 0.0),)


def test_a_curve_that_is_switched_off_limits_nothing() -> None:
    curves = SlowDownCurves(rtt_ms=None, loss=None, picture_ms=None)
    assert slow_down(curves, Measures(1e9, 1.0, 1e9)) == (1.0, ())
    assert slow_down(NO_SLOW_DOWN, Measures(1e9, 1.0, 1e9)) == (1.0, ())


def test_a_value_that_json_cannot_carry_is_left_out() -> None:
    assert slow_down(DEFAULTS, Measures(rtt_ms=math.inf))[1] == (Cause("rtt", None, 0.0),)


def curve_of(values: list[float], factors: list[float]) -> Curve:
    count = min(len(values), len(factors))
    return tuple(zip(sorted(values)[:count], sorted(factors, reverse=True)[:count], strict=True))


CURVES = st.builds(
    curve_of,
    st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=6, unique=True),
    st.lists(st.floats(0, 1), min_size=1, max_size=6),
)
VALUES = st.one_of(st.none(), st.floats(allow_nan=False))


@given(CURVES, st.floats(allow_nan=False), st.floats(allow_nan=False))
def test_on_any_curve_more_is_never_faster(curve: Curve, one: float, other: float) -> None:
    low, high = sorted((one, other))
    assert 0.0 <= on_curve(curve, high) <= on_curve(curve, low) + 1e-12 <= 1.0 + 1e-12


@given(CURVES, CURVES, CURVES, st.sampled_from(["off", "if_watching", "required"]), VALUES, VALUES, VALUES)
def test_the_factor_is_the_least_of_its_causes(
    rtt: Curve,
    loss: Curve,
    picture: Curve,
    rule: PictureRule,
    rtt_ms: float | None,
    share: float | None,
    picture_ms: float | None,
) -> None:
    curves = SlowDownCurves(rtt, loss, picture, rule)
    factor, causes = slow_down(curves, Measures(rtt_ms, share, picture_ms))
    assert 0.0 <= factor <= 1.0
    assert factor == min((cause.factor for cause in causes), default=1.0)
    assert [cause.factor for cause in causes] == sorted(cause.factor for cause in causes)
    assert all(cause.value is None or math.isfinite(cause.value) for cause in causes)
    assert factor <= slow_down(SlowDownCurves(rtt, loss, None, "off"), Measures(rtt_ms, share))[0]


# -- telling it


def limited(value: float) -> tuple[float, tuple[Cause, ...]]:
    return slow_down(DEFAULTS, Measures(rtt_ms=value))


def test_nothing_is_told_while_nothing_is_limited() -> None:
    report = LimitReport()
    assert not any(report.is_due(1.0, (), tick * 0.1) for tick in range(100))


def test_a_limit_is_told_at_once_and_its_end_too() -> None:
    report = LimitReport()
    assert report.is_due(*limited(450.0), 0.0)
    assert not report.is_due(*limited(450.0), 10.0)
    assert report.is_due(1.0, (), 20.0)


def test_small_changes_are_not_told() -> None:
    report = LimitReport()
    assert report.is_due(*limited(450.0), 0.0)
    assert not report.is_due(*limited(455.0), 1.0)
    assert report.is_due(*limited(500.0), 2.0)


def test_a_value_that_grows_is_told_even_if_the_factor_cannot_fall_further() -> None:
    report = LimitReport()
    assert report.is_due(*limited(2000.0), 0.0)
    assert not report.is_due(*limited(2100.0), 1.0)
    assert report.is_due(*limited(2300.0), 2.0)


def test_standstill_and_full_speed_are_always_told_exactly() -> None:
    report = LimitReport()
    assert report.is_due(0.01, (Cause("rtt", 1180.0, 0.01),), 0.0)
    assert report.is_due(0.0, (Cause("rtt", 1200.0, 0.0),), 1.0)


def test_another_cause_is_told() -> None:
    report = LimitReport()
    assert report.is_due(0.5, (Cause("rtt", 380.0, 0.5),), 0.0)
    assert report.is_due(0.5, (Cause("loss", 0.2, 0.5),), 1.0)
    assert report.is_due(0.5, (Cause("loss", None, 0.5),), 2.0)


@given(st.lists(st.tuples(st.floats(0, 3000), st.floats(0, 0.3)), max_size=60))
def test_never_more_than_five_times_a_second(walk: list[tuple[float, float]]) -> None:
    report, now_s, told_s = LimitReport(), 0.0, -math.inf
    for value, step_s in walk:
        now_s += step_s
        if report.is_due(*limited(value), now_s):
            assert now_s - told_s >= REPORT_PERIOD_S
            told_s = now_s


def test_what_is_not_known_hides_nothing_that_is() -> None:
    factor, causes = slow_down(SlowDownCurves(), Measures(rtt_ms=None, loss=1.0))
    assert factor < 1.0
    assert [cause.cause for cause in causes] == ["loss"]


@pytest.mark.parametrize(
    ("old", "new", "is_told"),
    [
        ((0.5, 10.0), (0.5, 11.0), True),
        ((0.5, 10.0), (0.5, 10.9), False),
        ((0.5, 0.1), (0.5, 0.2), True),
        ((0.5, 0.0), (0.5, 0.0), False),
        ((0.02, 10.0), (0.04, 10.0), True),
        ((0.02, 10.0), (0.03, 10.0), False),
        ((0.99, 10.0), (1.0, 10.0), True),
        ((0.01, 10.0), (0.0, 10.0), True),
    ],
)
def test_a_change_is_told_from_a_tenth_of_a_value_or_a_fiftieth_of_the_speed_on(
    old: tuple[float, float], new: tuple[float, float], is_told: bool
) -> None:
    report = LimitReport()
    assert report.is_due(old[0], (Cause("rtt", old[1], old[0]),), 0.0)
    assert report.is_due(new[0], (Cause("rtt", new[1], new[0]),), 0.2) == is_told, "0.2 s later, not sooner"
