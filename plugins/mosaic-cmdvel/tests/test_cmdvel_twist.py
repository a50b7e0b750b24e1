"""Limits keep the direction and reach every finite velocity."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_cmdvel import STANDSTILL, Twist, limited

speeds = st.floats(allow_nan=False, allow_infinity=False)
moderate = st.floats(min_value=-1e6, max_value=1e6)
limits = st.floats(min_value=1e-3, max_value=100)
twists = st.builds(Twist, speeds, speeds, speeds, speeds, speeds, speeds)


@given(twists, limits, limits)
def test_no_part_is_longer_than_its_limit(twist: Twist, linear: float, angular: float) -> None:
    result = limited(twist, max_linear_mps=linear, max_angular_radps=angular)

    assert result.linear_mps <= linear * (1 + 1e-9)
    assert result.angular_radps <= angular * (1 + 1e-9)


@given(twists)
def test_what_is_within_the_limits_stays_as_it_is(twist: Twist) -> None:
    assert limited(twist, max_linear_mps=math.inf, max_angular_radps=math.inf) == twist


@given(moderate, moderate, limits)
def test_a_planar_velocity_keeps_its_direction(x: float, y: float, maximum: float) -> None:
    result = limited(Twist(linear_x_mps=x, linear_y_mps=y), max_linear_mps=maximum, max_angular_radps=1.0)

    if math.hypot(x, y) > maximum:
        assert math.atan2(result.linear_y_mps, result.linear_x_mps) == pytest.approx(math.atan2(y, x), abs=1e-9)
        assert result.linear_mps == pytest.approx(maximum)


def test_a_velocity_near_the_largest_float_keeps_its_direction() -> None:
    result = limited(Twist(linear_x_mps=1.7e308, linear_y_mps=-1.7e308), max_linear_mps=1.0, max_angular_radps=1.0)

    assert result.linear_x_mps == pytest.approx(math.sqrt(0.5))
    assert result.linear_y_mps == pytest.approx(-math.sqrt(0.5))


def test_a_speeding_command_still_turns_as_asked() -> None:
    result = limited(Twist(linear_x_mps=10.0, angular_z_radps=0.5), max_linear_mps=1.0, max_angular_radps=1.5)

    assert result == Twist(linear_x_mps=1.0, angular_z_radps=0.5)


def test_only_the_zero_twist_is_a_standstill() -> None:
    assert STANDSTILL.is_zero
    assert Twist(linear_x_mps=-0.0).is_zero
    assert not Twist(angular_z_radps=1e-9).is_zero
