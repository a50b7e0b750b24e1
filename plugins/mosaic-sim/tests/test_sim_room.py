"""The yard: what is where, and that a robot has its place in it."""

import math

import pytest

from mosaic_sim.motion import Chassis, clearance
from mosaic_sim.room import COURTYARD_START, Box, Material, Post, Room, courtyard, distance_to_segment_m, outer_walls


@pytest.mark.parametrize("seed", range(20))
def test_the_robot_starts_in_the_open_and_can_reach_the_dock(seed: int) -> None:
    room = courtyard(seed)
    radius_m = Chassis().radius_m
    assert clearance(room, COURTYARD_START[:2])[0] > 2 * radius_m
    for step in range(21):
        share = step / 20
        place = tuple(a + share * (b - a) for a, b in zip(COURTYARD_START[:2], room.dock, strict=True))
        assert clearance(room, (place[0], place[1]))[0] > radius_m


def test_one_seed_is_one_yard_and_another_is_another() -> None:
    assert courtyard(3).solids == courtyard(3).solids
    assert courtyard(3).solids != courtyard(4).solids


def test_boxes_posts_and_the_outside_are_not_inside_the_room() -> None:
    room = Room(4, 4, solids=(*outer_walls(4, 4), Box(1, 0, 1.0, math.pi / 4), Post(-2, 0, 0.3, Material.PILLAR)))
    assert room.contains(0, 0)
    assert not room.contains(1.0, 0.6)
    assert room.contains(1.45, 0.45), "the corner that the turned box no longer covers"
    assert not room.contains(-2.2, 0)
    assert not room.contains(4.1, 0)
    assert not room.contains(0, -4.0)


def test_the_dock_is_a_square_around_its_centre() -> None:
    room = Room(4, 4, solids=tuple(outer_walls(4, 4)), dock=(1.0, 1.0), dock_half_m=0.5)
    assert room.is_docked(1.4, 0.6)
    assert not room.is_docked(1.6, 1.0)


def test_a_room_without_posts_has_no_circles() -> None:
    room = Room(4, 4, solids=tuple(outer_walls(4, 4)))
    assert room.circles.centre.shape == (0, 2)


def test_distance_to_a_segment_counts_from_its_nearest_point() -> None:
    assert distance_to_segment_m((0, 0), (2, 0), (1, 1)) == 1
    assert distance_to_segment_m((0, 0), (2, 0), (5, 4)) == 5
