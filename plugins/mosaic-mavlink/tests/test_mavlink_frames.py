"""North, east, down becomes east, north, up; forward, right, down becomes forward, left, up."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.messages import Quaternion
from mosaic_mavlink.telemetry.frames import attitude, east_north_of, enu_of_ned, flu_of_frd, in_body

ANGLE = st.floats(-math.pi, math.pi)
METRES = st.floats(-1e4, 1e4)
HALF = math.sqrt(0.5)


def rotated(vector: tuple[float, float, float], by: Quaternion) -> tuple[float, float, float]:
    return in_body(vector, Quaternion(x=-by.x, y=-by.y, z=-by.z, w=by.w))


def ned_of_body(vector: tuple[float, float, float], roll: float, pitch: float, yaw: float) -> tuple[float, ...]:
    """By the matrix of aerospace text books, which knows nothing of quaternions."""
    x, y, z = vector
    y, z = y * math.cos(roll) - z * math.sin(roll), y * math.sin(roll) + z * math.cos(roll)
    x, z = x * math.cos(pitch) + z * math.sin(pitch), -x * math.sin(pitch) + z * math.cos(pitch)
    return x * math.cos(yaw) - y * math.sin(yaw), x * math.sin(yaw) + y * math.cos(yaw), z


@pytest.mark.parametrize(
    ("angles", "expected"),
    [
        ((0.0, 0.0, math.pi / 2), (0.0, 0.0, 0.0, 1.0)),  # nose east: our x
        ((0.0, 0.0, 0.0), (0.0, 0.0, HALF, HALF)),  # nose north: a quarter to the left of east
        ((0.0, 0.0, -math.pi / 2), (0.0, 0.0, 1.0, 0.0)),  # nose west
        ((math.pi / 2, 0.0, math.pi / 2), (HALF, 0.0, 0.0, HALF)),  # right wing down, nose east
        ((0.0, math.pi / 2, math.pi / 2), (0.0, -HALF, 0.0, HALF)),  # nose up, from east
    ],
)
def test_attitudes_by_hand(angles: tuple[float, float, float], expected: tuple[float, ...]) -> None:
    found = attitude(*angles)
    assert (found.x, found.y, found.z, found.w) == pytest.approx(expected, abs=1e-12)


def test_axes_by_hand() -> None:
    assert enu_of_ned(1.0, 2.0, 3.0) == (2.0, 1.0, -3.0)
    assert flu_of_frd(1.0, 2.0, 3.0) == (1.0, -2.0, -3.0)


@given(ANGLE, ANGLE, ANGLE, st.tuples(METRES, METRES, METRES))
def test_an_attitude_turns_a_body_as_the_text_books_matrix_does(
    roll: float, pitch: float, yaw: float, frd: tuple[float, float, float]
) -> None:
    north, east, down = ned_of_body(frd, roll, pitch, yaw)
    assert rotated(flu_of_frd(*frd), attitude(roll, pitch, yaw)) == pytest.approx(
        enu_of_ned(north, east, down), abs=1e-6
    )


@given(ANGLE, ANGLE, ANGLE, st.tuples(METRES, METRES, METRES))
def test_to_the_body_and_back_is_where_it_was(
    roll: float, pitch: float, yaw: float, world: tuple[float, float, float]
) -> None:
    orientation = attitude(roll, pitch, yaw)
    assert rotated(in_body(world, orientation), orientation) == pytest.approx(world, abs=1e-6)


@given(st.tuples(METRES, METRES, METRES))
def test_both_changes_of_axes_are_their_own_inverse(vector: tuple[float, float, float]) -> None:
    assert enu_of_ned(*enu_of_ned(*vector)) == vector
    assert flu_of_frd(*flu_of_frd(*vector)) == vector


def test_a_minute_of_latitude_is_a_sea_mile_and_of_longitude_half_of_one_at_sixty_degrees() -> None:
    east, north = east_north_of(60.0 + 1 / 60, 10.0, (60.0, 10.0))
    assert (east, north) == pytest.approx((0.0, 1853), abs=1)
    east, north = east_north_of(60.0, 10.0 + 1 / 60, (60.0, 10.0))
    assert (east, north) == pytest.approx((926.6, 0.0), abs=1)


def test_the_date_line_is_no_way_around_the_earth() -> None:
    east, _ = east_north_of(0.0, -179.999, (0.0, 179.999))
    assert east == pytest.approx(222.4, abs=1)
