"""The picture: golden properties of perspective, light and place, not golden pixels."""

import math

import numpy as np
import pytest

from mosaic_sim.raycast import cast
from mosaic_sim.renderer import Renderer
from mosaic_sim.room import Box, Room, courtyard, outer_walls

WIDTH, HEIGHT = 320, 240
HALL = Room(8, 8, solids=tuple(outer_walls(8, 8)))


@pytest.fixture(scope="module")
def hall() -> Renderer:
    return Renderer(HALL, width=WIDTH, height=HEIGHT)


def wall_rows(image: np.ndarray) -> tuple[int, int]:
    """First and last row of the east wall (reddish) in the middle column."""
    column = image[:, WIDTH // 2].astype(int)
    reddish = np.flatnonzero(column[:, 2] > column[:, 0] + 20)
    return int(reddish[0]), int(reddish[-1])


def test_a_picture_is_bgr_of_the_asked_size_and_owns_its_memory(hall: Renderer) -> None:
    first = hall.render(0, 0, 0, 0)
    kept = first.copy()
    second = hall.render(3, 0, 1, 0)
    assert first.shape == (HEIGHT, WIDTH, 3)
    assert first.dtype == np.uint8
    assert first.flags.c_contiguous
    assert (first == kept).all()
    assert (first != second).any()


def test_a_nearer_wall_is_taller_and_brighter(hall: Renderer) -> None:
    near, far = hall.render(6.0, 0.3, 0, 0), hall.render(-4.0, 0.3, 0, 0)
    near_top, near_bottom = wall_rows(near)
    far_top, far_bottom = wall_rows(far)
    assert near_bottom - near_top > 3 * (far_bottom - far_top)
    near_face = near[near_top:near_bottom, WIDTH // 2 - 40 : WIDTH // 2 + 40]
    far_face = far[far_top:far_bottom, WIDTH // 2 - 10 : WIDTH // 2 + 10]
    assert near_face.mean() > 1.2 * far_face.mean()


def test_the_wall_stands_where_perspective_puts_it(hall: Renderer) -> None:
    depth_m = 4.0
    focal_px = WIDTH / 2 / math.tan(math.radians(75) / 2)
    top, _ = wall_rows(hall.render(8 - depth_m, 0.3, 0, 0))
    coping_m = HALL.wall_height_m * (1 / 14)
    expected = HEIGHT / 2 - (HALL.wall_height_m - coping_m - 0.42) / depth_m * focal_px
    assert top == pytest.approx(expected, abs=4)


def test_above_the_walls_is_sky_and_below_is_floor(hall: Renderer) -> None:
    image = hall.render(0, 0, 0, 0).astype(int)
    sky, floor = image[:20], image[-20:]
    assert (sky[..., 0] >= sky[..., 2]).mean() > 0.95, "blue at least as strong as red"
    assert np.abs(floor[..., 0] - floor[..., 2]).max() < 40, "paving is gray"


def test_a_low_box_hides_the_foot_of_the_wall_but_not_its_top(hall: Renderer) -> None:
    boxed = Room(8, 8, solids=(*outer_walls(8, 8), Box(4.0, 0.0, 1.0)))
    with_box = Renderer(boxed, width=WIDTH, height=HEIGHT).render(0, 0, 0, 0)
    without = hall.render(0, 0, 0, 0)
    differs = (with_box != without).any(axis=2)[:, WIDTH // 2]
    top = wall_rows(without)[0]
    assert not differs[: top + 3].any()
    assert differs[HEIGHT // 2 : HEIGHT // 2 + 30].all()


def test_a_box_behind_a_wall_is_not_seen(hall: Renderer) -> None:
    outside = Room(8, 8, solids=(*outer_walls(8, 8), Box(12.0, 0.0, 1.0)))
    with_box = Renderer(outside, width=WIDTH, height=HEIGHT).render(0, 0, 0, 0)
    assert (with_box == hall.render(0, 0, 0, 0)).all()


def test_turning_left_moves_things_to_the_right() -> None:
    room = Room(8, 8, solids=(*outer_walls(8, 8), Box(4.0, 0.0, 1.0)))
    slopes = np.tan(np.linspace(math.radians(37), -math.radians(37), WIDTH))
    seen = []
    for yaw in (0.0, 0.3):
        forward, left = np.array((math.cos(yaw), math.sin(yaw))), np.array((-math.sin(yaw), math.cos(yaw)))
        seen.append(np.flatnonzero(np.isfinite(cast(room, (0, 0), forward + slopes[:, None] * left, False).distance)))
    assert seen[1].mean() > seen[0].mean() + 30


def test_one_seed_place_and_time_give_one_picture() -> None:
    pictures = [Renderer(courtyard(1), width=WIDTH, height=HEIGHT).render(-3, -2, 0.5, 7.0) for _ in range(2)]
    assert (pictures[0] == pictures[1]).all()


def test_clouds_drift_though_the_robot_stands(hall: Renderer) -> None:
    now, later = hall.render(0, 0, 0, 0), hall.render(0, 0, 0, 5)
    assert (now[: HEIGHT // 3] != later[: HEIGHT // 3]).any()
    assert (now[HEIGHT // 2 :] == later[HEIGHT // 2 :]).all()


@pytest.mark.parametrize("place", [(7.99, 0, 0), (-7.99, 7.99, 2), (0, 0, 1000.0), (0.0, 0.0, -1000.0)])
def test_no_place_breaks_the_picture(hall: Renderer, place: tuple[float, float, float]) -> None:
    assert hall.render(*place, time_s=1e6).shape == (HEIGHT, WIDTH, 3)


def test_the_scenery_is_drawn_in_steps_and_once() -> None:
    shed = Room(2, 2, solids=tuple(outer_walls(2, 2)))
    left_early, whole = (Renderer(shed, width=WIDTH, height=HEIGHT) for _ in range(2))
    next(left_early.prepared())
    assert len([*whole.prepared()]) > 3
    assert [*whole.prepared()] == []
    assert (left_early.render(0, 0, 0, 0) == whole.render(0, 0, 0, 0)).all()
