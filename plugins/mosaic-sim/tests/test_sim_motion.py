"""The base: inertia, curves, and walls that hold."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mosaic_sim.motion import Chassis, Motion, clearance, moved, wheel_targets
from mosaic_sim.room import Room, courtyard, outer_walls
from mosaic_sim.world import STEP_S, World

CHASSIS = Chassis()
HALL = Room(50, 50, solids=tuple(outer_walls(50, 50)))


def driven(command: tuple[float, float], seconds: float, motion: Motion | None = None, room: Room = HALL) -> Motion:
    motion = motion or Motion()
    for _ in range(round(seconds / STEP_S)):
        motion = moved(room, CHASSIS, motion, command, STEP_S)
    return motion


commands = st.tuples(st.floats(-3, 3), st.floats(-6, 6))


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 5), script=st.lists(st.tuples(commands, st.integers(1, 120)), min_size=1, max_size=8))
def test_no_command_ever_drives_the_robot_into_anything(
    seed: int, script: list[tuple[tuple[float, float], int]]
) -> None:
    room = courtyard(seed)
    world = World(room, seed=seed)
    for command, steps in script:
        world.drive(*command)
        for _ in range(steps):
            world.advance(STEP_S)
            motion = world.state.motion
            assert clearance(room, (motion.x_m, motion.y_m))[0] >= CHASSIS.radius_m - 1e-9
            assert room.contains(motion.x_m, motion.y_m)


@given(command=commands)
def test_wheels_never_turn_faster_than_they_can_and_keep_the_curve(command: tuple[float, float]) -> None:
    left, right = wheel_targets(CHASSIS, *command)
    assert max(abs(left), abs(right)) <= CHASSIS.max_wheel_mps + 1e-9
    linear, angular = (left + right) / 2, (right - left) / CHASSIS.track_width_m
    assert linear * command[1] == pytest.approx(angular * command[0], abs=1e-6)


def test_speed_is_reached_with_inertia_and_not_at_once() -> None:
    assert driven((1.0, 0.0), 0.05).linear_mps < 0.2
    assert driven((1.0, 0.0), 2.0).linear_mps == pytest.approx(1.0, abs=1e-3)


def test_acceleration_stays_within_the_motors() -> None:
    motion, fastest = Motion(), 0.0
    for _ in range(100):
        motion = moved(HALL, CHASSIS, motion, (1.2, 0.0), STEP_S)
        fastest = max(fastest, abs(motion.linear_mps2))
    assert fastest <= CHASSIS.max_wheel_mps2 + 1e-9


def test_a_stopped_robot_comes_to_rest_and_stays_there() -> None:
    rolling = driven((1.0, 0.5), 2.0)
    rest = driven((0.0, 0.0), 1.5, rolling)
    assert (rest.linear_mps, rest.angular_radps) == (0.0, 0.0)
    assert driven((0.0, 0.0), 1.0, rest).x_m == rest.x_m


def test_turning_left_is_counter_clockwise_on_the_spot() -> None:
    motion = driven((0.0, 1.0), 2.0)
    assert motion.yaw_rad > 1.5
    assert math.hypot(motion.x_m, motion.y_m) < 1e-9


def test_a_constant_curve_is_a_circle_of_the_right_radius() -> None:
    steady = driven((0.5, 0.5), 2.0)
    quarter = driven((0.5, 0.5), math.pi / 2 / 0.5, steady)
    chord_m = math.dist((steady.x_m, steady.y_m), (quarter.x_m, quarter.y_m))
    assert chord_m == pytest.approx(math.sqrt(2) * 1.0, rel=0.01)


def test_driving_straight_into_a_wall_stops_there() -> None:
    room = Room(2, 2, solids=tuple(outer_walls(2, 2)))
    motion = driven((1.0, 0.0), 5.0, room=room)
    assert motion.x_m == pytest.approx(2 - CHASSIS.radius_m, abs=0.02)
    assert motion.is_touching
    assert motion.linear_mps == pytest.approx(0.0, abs=1e-6)


def test_a_robot_that_grazes_a_wall_slides_along_it() -> None:
    room = Room(3, 3, solids=tuple(outer_walls(3, 3)))
    motion = driven((0.8, 0.0), 4.0, Motion(x_m=-2, y_m=2.5, yaw_rad=0.5), room)
    assert motion.x_m > 0.0
    assert motion.y_m == pytest.approx(3 - CHASSIS.radius_m, abs=0.02)


def test_clearance_points_away_from_the_nearest_wall() -> None:
    gap_m, away = clearance(HALL, (49.0, 0.0))
    assert gap_m == pytest.approx(1.0)
    assert away == pytest.approx((-1.0, 0.0))
