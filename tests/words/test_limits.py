"""A limit that can't work is refused when it is written down, with its culprit."""

from __future__ import annotations

from typing import Any

import pytest

from mosaic_core.words.limits import NO_SLOW_DOWN, Curve, FieldLimit, SlowDownCurves, check_curve


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
