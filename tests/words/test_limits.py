"""A limit that can't work is refused when it is written down, with its culprit."""

from __future__ import annotations

from typing import Any

import pytest

from mosaic_core.words.limits import (
    NO_SLOW_DOWN,
    Curve,
    FieldLimit,
    ImpossibleLimit,
    SlowDownCurves,
    check_curve,
    clashes,
)


@pytest.mark.parametrize(
    ("limit", "culprit"),
    [
        ({"fields": ()}, "names of its fields"),
        ({"fields": ("x", "x")}, "each once"),
        ({"fields": ("",)}, "dotted path"),
        ({"fields": ("linear.",)}, "dotted path"),
        ({"fields": ("x",), "min": 0.1}, "zero must be allowed"),
        ({"fields": ("x",), "max": -0.1}, "zero must be allowed"),
        ({"fields": ("x", "y"), "max_norm": -1.0}, "x and y: max_norm"),
        ({"fields": ("x",), "max_rise_per_s": 0.0}, "rate must be positive"),
        ({"fields": ("x",), "max_fall_per_s": -1.0}, "rate must be positive"),
        ({"fields": ("x",), "max": float("inf")}, "finite"),
        ({"fields": ("x",), "min": float("nan")}, "finite"),
    ],
)
def test_a_limit_that_cannot_work_is_refused(limit: dict[str, Any], culprit: str) -> None:
    with pytest.raises(ValueError, match=culprit):
        FieldLimit(**limit)


@pytest.mark.parametrize(
    ("limit", "key", "cure"),
    [
        ({"min": 5.0}, "min", "`kind: position`"),
        ({"min": 1.0, "max": -1.0}, "min", "swap them"),
        ({"max": -5.0}, "max", "`kind: position`"),
        ({"max_rate_per_s": 1.0}, "max_rate_per_s", "max_rise_per_s and max_fall_per_s"),
        ({"kind": "position", "max_rise_per_s": 1.0}, "max_rise_per_s", "max_rate_per_s"),
        ({"kind": "position", "max_fall_per_s": 1.0}, "max_fall_per_s", "max_rate_per_s"),
        ({"kind": "position", "min": 2.0, "max": 1.0}, "min", "swap"),
        ({"kind": "position", "max_norm": -1.0}, "max_norm", ""),
        ({"kind": "position", "max_rate_per_s": 0.0}, "", ""),
    ],
)
def test_what_makes_no_sense_of_its_kind_is_told_with_its_cure(limit: dict[str, Any], key: str, cure: str) -> None:
    with pytest.raises(ImpossibleLimit, match="limit of x") as told:
        FieldLimit(("x",), **limit)
    assert told.value.key == key
    assert cure in told.value.cure


def test_a_position_needs_no_zero() -> None:
    assert FieldLimit(("x",), 5.0, 90.0, kind="position").min == 5.0
    assert FieldLimit(("x",), 5.0, 5.0, kind="position").max == 5.0


def position(low: float | None, high: float | None, norm: float | None = None) -> FieldLimit:
    return FieldLimit(("x",), low, high, norm, kind="position")


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        ((position(0, 5), position(5, 9)), []),
        ((position(0, 5), position(6, 9)), ["no position is left for 'x': at least 6 and at most 5"]),
        ((position(0, 5), FieldLimit(("x",), max=5)), ["'x' is limited as a velocity and as a position"]),
        ((position(1, 5), position(None, None, 9)), ["'x' has a max_norm, the distance from 0, and a range without 0"]),
        ((position(-9, -1, 9),), ["'x' has a max_norm, the distance from 0, and a range without 0"]),
        ((position(0, 5), position(-5, 0, 9)), []),
        ((FieldLimit(("x",), max=5), FieldLimit(("x", "y"), max_norm=5)), []),
    ],
)
def test_limits_of_one_field_that_cannot_all_be_kept_are_told(limits: tuple[FieldLimit, ...], words: list[str]) -> None:
    assert [message for _, message in clashes(limits)] == words


def test_a_limit_may_forbid_motion_altogether() -> None:
    assert FieldLimit(("x",), min=0.0, max=0.0, max_norm=0.0).max == 0.0


@pytest.mark.parametrize(
    ("curve", "culprit"),
    [
        ((), "at least one point"),
        (((1.0, 1.5),), "from 0 to 1"),
        (((1.0, -0.1),), "from 0 to 1"),
        (((1.0, 1.0), (1.0, 0.5)), "values of a curve must rise, 1 follows 1"),
        (((1.0, 0.5), (2.0, 1.0)), "factors of a curve must not rise"),
        (((float("nan"), 1.0),), "finite"),
        (((1.0, float("inf")),), "finite"),
    ],
)
def test_a_curve_that_is_none_is_refused_by_its_name(curve: Curve, culprit: str) -> None:
    with pytest.raises(ValueError, match=culprit):
        check_curve("rtt_ms", curve)
    with pytest.raises(ValueError, match=r"^loss: "):
        SlowDownCurves(loss=curve)


def test_a_required_picture_needs_a_curve() -> None:
    with pytest.raises(ValueError, match="picture_ms"):
        SlowDownCurves(picture_ms=None, picture="required")


def test_the_defaults_are_curves_and_none_is_none() -> None:
    assert SlowDownCurves().picture == "if_watching"
    assert (NO_SLOW_DOWN.rtt_ms, NO_SLOW_DOWN.loss, NO_SLOW_DOWN.picture_ms) == (None, None, None)
