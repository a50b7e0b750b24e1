"""Ticks and radians."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_arm.calibration import TICKS_PER_TURN
from mosaic_arm.joint_scale import RAD_PER_TICK, JointScale


@st.composite
def scales(draw: st.DrawFn) -> JointScale:
    low = draw(st.integers(0, TICKS_PER_TURN - 2))
    high = draw(st.integers(low + 1, TICKS_PER_TURN - 1))
    return JointScale(low, high, draw(st.booleans()))


@given(scales(), st.data())
def test_an_angle_and_its_ticks_are_one_place(scale: JointScale, data: st.DataObject) -> None:
    ticks = data.draw(st.integers(scale.range_min, scale.range_max))
    assert scale.goal_ticks(scale.angle_rad(ticks)) in (ticks, ticks + 1, ticks - 1)
    assert abs(scale.angle_rad(scale.goal_ticks(scale.angle_rad(ticks))) - scale.angle_rad(ticks)) <= RAD_PER_TICK


@given(scales(), st.floats(-100, 100))
def test_no_goal_leaves_the_range(scale: JointScale, angle_rad: float) -> None:
    assert scale.range_min <= scale.goal_ticks(angle_rad) <= scale.range_max


@given(scales(), st.integers(0, 4095), st.integers(-5, 5))
def test_whole_turns_make_no_difference_to_the_angle(scale: JointScale, ticks: int, turns: int) -> None:
    assert scale.angle_rad(ticks + turns * TICKS_PER_TURN) == pytest.approx(scale.angle_rad(ticks))


@given(scales(), st.floats(-3, 3), st.integers(-20000, 20000))
def test_a_motor_that_counts_turns_is_never_sent_more_than_a_turn_away(
    scale: JointScale, angle_rad: float, present: int
) -> None:
    goal = scale.goal_near(angle_rad, present)
    assert abs(goal - present) <= TICKS_PER_TURN
    assert (goal - scale.goal_ticks(angle_rad)) % TICKS_PER_TURN == 0


@given(scales(), st.integers(0, 4095), st.integers(0, 4095))
def test_the_drive_mode_turns_the_direction_around(scale: JointScale, one: int, other: int) -> None:
    mirrored = JointScale(scale.range_min, scale.range_max, not scale.is_reversed)
    assert mirrored.angle_rad(one) == -scale.angle_rad(one)
    assert mirrored.speed_radps(other) == -scale.speed_radps(other)
    assert scale.limits_rad == mirrored.limits_rad


@given(scales())
def test_zero_is_the_middle_and_the_range_ends_at_the_limits(scale: JointScale) -> None:
    ends = sorted((scale.angle_rad(scale.range_min), scale.angle_rad(scale.range_max)))
    assert ends == pytest.approx(list(scale.limits_rad))
    assert abs(scale.goal_ticks(0.0) - scale.middle) <= 0.5


@pytest.mark.parametrize("angle", [math.nan, math.inf, -math.inf])
def test_what_is_no_angle_has_no_ticks(angle: float) -> None:
    with pytest.raises(ValueError, match="is no angle"):
        JointScale(0, 4095).goal_ticks(angle)
