"""A sensor may sit any way round: what it measures and how it is turned are told of the robot."""

from __future__ import annotations

import math
from itertools import product
from typing import Any, get_args

import pytest

from mosaic_core.messages import Quaternion
from mosaic_i2c.mounting import Axis, ImuMounting


def possible() -> list[ImuMounting]:
    found = []
    for axes in product(get_args(Axis), repeat=3):
        try:
            found.append(ImuMounting(axes))
        except ValueError:
            continue
    return found


def rotated(q: Quaternion, v: tuple[float, float, float]) -> tuple[float, ...]:
    """By the textbook: v + 2 w (u × v) + 2 u × (u × v)."""
    u = (q.x, q.y, q.z)
    once = cross(u, v)
    twice = cross(u, once)
    return tuple(a + 2 * q.w * b + 2 * c for a, b, c in zip(v, once, twice, strict=True))


def cross(a: Any, b: Any) -> tuple[float, float, float]:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def test_there_are_as_many_ways_as_a_cube_has() -> None:
    assert len(possible()) == 24


@pytest.mark.parametrize("mounting", possible(), ids=lambda one: " ".join(one.axes))
def test_vector_and_orientation_agree_in_the_world(mounting: ImuMounting) -> None:
    sensor = Quaternion(w=0.5, x=0.5, y=-0.5, z=0.5)
    seen = (0.3, -1.2, 2.0)
    of_robot = mounting.orientation(sensor)
    assert math.hypot(of_robot.w, of_robot.x, of_robot.y, of_robot.z) == pytest.approx(1)
    assert rotated(of_robot, mounting.turned(seen)) == pytest.approx(rotated(sensor, seen))


def test_a_mirrored_sensor_is_none() -> None:
    with pytest.raises(ValueError, match="right hand"):
        ImuMounting(("x", "y", "-z"))
