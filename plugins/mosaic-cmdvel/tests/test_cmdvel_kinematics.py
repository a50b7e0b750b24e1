"""Wheel speeds and velocities are two views of one motion."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_cmdvel.kinematics import DifferentialBase, WheelSpeeds, saturated
from mosaic_core.messages import Twist

speeds = st.floats(min_value=-50, max_value=50)
bases = st.builds(DifferentialBase, st.floats(min_value=0.01, max_value=1), st.floats(min_value=0.05, max_value=3))
wheel_speeds = st.builds(WheelSpeeds, speeds, speeds)


@given(bases, speeds, speeds)
def test_a_velocity_survives_the_way_to_the_wheels_and_back(base: DifferentialBase, x: float, yaw: float) -> None:
    back = base.twist(base.wheels(Twist.planar(x_mps=x, yaw_radps=yaw)))

    assert back.linear.x == pytest.approx(x, abs=1e-9)
    assert back.angular.z == pytest.approx(yaw, abs=1e-9)


@given(bases, wheel_speeds)
def test_wheel_speeds_survive_the_way_to_a_velocity_and_back(base: DifferentialBase, wheels: WheelSpeeds) -> None:
    back = base.wheels(base.twist(wheels))

    assert back.left_radps == pytest.approx(wheels.left_radps, abs=1e-9)
    assert back.right_radps == pytest.approx(wheels.right_radps, abs=1e-9)


def test_turning_left_makes_the_right_wheel_faster() -> None:
    base = DifferentialBase(wheel_radius_m=0.1, track_width_m=0.5)

    assert base.wheels(Twist.planar(yaw_radps=1.0)) == WheelSpeeds(left_radps=-2.5, right_radps=2.5)
    assert base.wheels(Twist.planar(x_mps=1.0)) == WheelSpeeds(left_radps=10.0, right_radps=10.0)


@given(wheel_speeds, st.floats(min_value=0.1, max_value=20))
def test_no_wheel_is_faster_than_its_maximum(wheels: WheelSpeeds, maximum: float) -> None:
    slowed = saturated(wheels, maximum)

    assert max(abs(slowed.left_radps), abs(slowed.right_radps)) <= maximum


@given(bases, wheel_speeds, st.floats(min_value=0.1, max_value=20))
def test_saturation_keeps_the_curve(base: DifferentialBase, wheels: WheelSpeeds, maximum: float) -> None:
    wanted, driven = base.twist(wheels), base.twist(saturated(wheels, maximum))

    # the same curvature: yaw per metre, as a cross product so that straight and spot turns need no division
    cross = wanted.linear.x * driven.angular.z - driven.linear.x * wanted.angular.z
    assert math.isclose(cross, 0.0, abs_tol=1e-6)
    assert wanted.linear.x * driven.linear.x >= 0


@given(wheel_speeds)
def test_wheels_within_their_maximum_stay_as_they_are(wheels: WheelSpeeds) -> None:
    assert saturated(wheels, 50.0) == wheels
