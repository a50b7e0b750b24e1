"""Rays against the room: distances equal those of plane geometry."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_sim.raycast import cast
from mosaic_sim.room import Box, Material, Post, Room, outer_walls

HALF_X_M, HALF_Y_M = 4.0, 3.0
EMPTY = Room(HALF_X_M, HALF_Y_M, solids=tuple(outer_walls(HALF_X_M, HALF_Y_M)))
angles = st.floats(0, 2 * math.pi, allow_nan=False)
inside_x = st.floats(-3.5, 3.5)
inside_y = st.floats(-2.5, 2.5)


def unit(*angles_rad: float) -> np.ndarray:
    return np.array([(math.cos(a), math.sin(a)) for a in angles_rad])


@given(x=inside_x, y=inside_y, angle=angles)
def test_a_ray_in_an_empty_room_is_as_long_as_geometry_says(x: float, y: float, angle: float) -> None:
    cos, sin = math.cos(angle), math.sin(angle)
    to_x = (math.copysign(HALF_X_M, cos) - x) / cos if abs(cos) > 1e-12 else math.inf
    to_y = (math.copysign(HALF_Y_M, sin) - y) / sin if abs(sin) > 1e-12 else math.inf
    assert cast(EMPTY, (x, y), unit(angle)).distance[0] == pytest.approx(min(to_x, to_y), abs=1e-6)


@given(angle=angles, distance=st.floats(0.6, 2.0), radius=st.floats(0.05, 0.5))
def test_a_ray_at_a_post_ends_at_its_skin(angle: float, distance: float, radius: float) -> None:
    post = Post(distance * math.cos(angle), distance * math.sin(angle), radius, Material.CONE)
    hits = cast(Room(9, 9, solids=(*outer_walls(9, 9), post)), (0.0, 0.0), unit(angle))
    assert hits.distance[0] == pytest.approx(distance - radius, abs=1e-6)
    assert hits.material[0] == Material.CONE
    assert hits.facing[0] == pytest.approx(1.0, abs=1e-6)


def test_every_ray_of_a_closed_room_hits_something() -> None:
    hits = cast(EMPTY, (1.0, -2.0), unit(*np.linspace(0, 2 * math.pi, 720)))
    assert np.isfinite(hits.distance).all()


def test_the_four_walls_have_their_own_materials() -> None:
    hits = cast(EMPTY, (0.0, 0.0), unit(0, math.pi / 2, math.pi, -math.pi / 2))
    assert list(hits.material) == [Material.EAST, Material.NORTH, Material.WEST, Material.SOUTH]


def test_normals_look_back_at_the_viewer() -> None:
    directions = unit(*np.linspace(0, 6, 50))
    hits = cast(EMPTY, (0.0, 0.0), directions)
    assert (np.sum(hits.normal * directions, axis=1) < 0).all()


def test_tall_and_low_things_can_be_looked_for_apart() -> None:
    room = Room(4, 4, solids=(*outer_walls(4, 4), Box(2, 0, 1.0)))
    assert cast(room, (0, 0), unit(0)).distance[0] == pytest.approx(1.5)
    assert cast(room, (0, 0), unit(0), tall=True).distance[0] == pytest.approx(4.0)
    assert cast(room, (0, 0), unit(0, 1.5), tall=False).distance == pytest.approx([1.5, math.inf])


def test_a_longer_direction_counts_in_its_own_lengths() -> None:
    assert cast(EMPTY, (0, 0), 2 * unit(0)).distance[0] == pytest.approx(2.0)


def test_the_texture_runs_on_along_a_wall() -> None:
    angles_rad = np.linspace(-0.5, 0.5, 20)
    u = cast(EMPTY, (0, 0), unit(*angles_rad)).u
    assert (np.diff(u) > 0).all() or (np.diff(u) < 0).all()
