"""Signals go to their goals at their speeds, and a simulation keeps pace with the clock: without MuJoCo."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_mujoco.world.pace import MAX_CATCH_UP_S, StepPace
from mosaic_mujoco.world.setpoints import Setpoints

GOALS = st.floats(-10, 10)
SPEEDS = st.floats(0.01, 50)


@given(GOALS, SPEEDS, st.lists(st.floats(0.001, 0.1), max_size=30))
def test_a_signal_is_never_faster_than_its_speed_and_never_beyond_its_goal(
    goal: float, speed: float, passed_s: list[float]
) -> None:
    setpoints = Setpoints(2)
    setpoints.aim({1: goal}, {1: speed})
    for duration_s in passed_s:
        before = float(setpoints.now[1])
        after = float(setpoints.advance(duration_s)[1])
        assert abs(after - before) <= speed * duration_s + 1e-12
        assert min(0.0, goal) <= after <= max(0.0, goal)
        assert setpoints.now[0] == 0.0


@given(GOALS, SPEEDS)
def test_a_signal_arrives_when_its_time_has_passed(goal: float, speed: float) -> None:
    setpoints = Setpoints(1)
    setpoints.aim({0: goal}, {0: speed})
    assert setpoints.advance(abs(goal) / speed + 1e-9)[0] == goal


def test_without_a_speed_a_signal_is_there_at_once_and_stays_there_when_told() -> None:
    setpoints = Setpoints(2)
    setpoints.aim({0: 3.0})
    setpoints.aim({1: 1.0}, {1: 1.0})
    assert setpoints.advance(0.25).tolist() == [3.0, 0.25]
    setpoints.stay([1])
    assert setpoints.advance(9.0).tolist() == [3.0, 0.25]
    setpoints.settle(np.array([5.0, 6.0]))
    assert setpoints.advance(9.0).tolist() == [5.0, 6.0]


@given(st.lists(st.floats(0, 0.5), max_size=40), st.floats(0.1, 20), st.floats(0.0005, 0.02))
def test_every_second_is_simulated_or_told_to_be_left_out(
    passed_s: list[float], speed: float, timestep_s: float
) -> None:
    pace = StepPace(timestep_s, speed)
    steps = 0
    for one_s in passed_s:
        due = pace.due(one_s)
        assert due * timestep_s <= max(MAX_CATCH_UP_S * speed, timestep_s) + 1e-6
        steps += due
    total_s = math.fsum(passed_s) * speed
    assert steps * timestep_s + pace.left_out_s == pytest.approx(total_s, abs=timestep_s + 1e-6)


def test_a_pause_is_not_caught_up() -> None:
    pace = StepPace(0.01)
    assert pace.due(0.055) == 5
    pace.forget()
    assert pace.due(0.005) == 0
    assert pace.left_out_s == 0.0
