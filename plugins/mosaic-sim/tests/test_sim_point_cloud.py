"""The simulated lidar measures the room: walls and ground at their places, nothing above the walls."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mosaic_core import Shared
from mosaic_core.contract.handler import Handler
from mosaic_core.testing import build, collect
from mosaic_sensors.point_cloud import PointCloud, decoded
from mosaic_sim.live_world import shared_world
from mosaic_sim.motion import Motion
from mosaic_sim.point_cloud import Lidar, SimPointCloud, SimPointCloudConfigurer, SimPointCloudParams
from mosaic_sim.room import Material, Post, Room, outer_walls


def looked(room: Room, motion: Motion, **params: float) -> PointCloud:
    lidar = Lidar(room, SimPointCloudParams.model_validate({"noise_m": 0.0, **params}))
    return lidar.look(motion, np.random.default_rng(0))


def test_walls_stand_where_they_are_and_end_at_their_height() -> None:
    room = Room(3, 2, solids=tuple(outer_walls(3, 2)))
    cloud = looked(room, Motion(0.0, 0.0, math.pi / 2))
    x, y, z = cloud.xyz.T
    walls = np.isclose(np.abs(x), 2, atol=1e-3) | np.isclose(np.abs(y), 3, atol=1e-3)
    assert (walls | (np.abs(z) < 1e-6)).all()
    assert room.wall_height_m - 0.2 < z.max() <= room.wall_height_m + 1e-6
    assert 0.3 < walls.mean() < 0.95


def test_a_low_thing_hides_the_wall_behind_it_up_to_its_top() -> None:
    room = Room(5, 5, solids=(*outer_walls(5, 5), Post(2.0, 0.0, 0.3, Material.CONE)))
    cloud = looked(room, Motion(0.0, 0.0, 0.0), columns=360)
    ahead = cloud.chosen(np.abs(cloud.xyz[:, 1] / np.maximum(cloud.xyz[:, 0], 1e-6)) < 0.05)
    ahead = ahead.chosen(ahead.xyz[:, 0] > 0)
    near, far = ahead.xyz[ahead.xyz[:, 0] < 2.1], ahead.xyz[ahead.xyz[:, 0] > 4.9]
    assert near[:, 2].max() <= room.low_height_m
    assert far[:, 2].min() > room.low_height_m
    assert cloud.rgb is not None
    assert len(np.unique(cloud.rgb, axis=0)) >= 4


def test_what_is_beyond_its_reach_gives_no_return() -> None:
    cloud = looked(Room(50, 50, solids=tuple(outer_walls(50, 50))), Motion(0.0, 0.0), reach_m=4.0)
    assert np.linalg.norm(cloud.xyz - (0, 0, 0.45), axis=1).max() <= 4.0 + 1e-3


def test_the_connector_sends_what_operators_read_in_the_robots_own_frame() -> None:
    shared = Shared()
    handlers = build(SimPointCloudConfigurer, params={"columns": 90, "parallel_num": 2}, shared=shared, label="cloud")
    assert [handler.label for handler in handlers] == ["cloud", "cloud-0", "cloud-1"]
    sender: Handler = handlers[0]
    assert isinstance(sender, SimPointCloud)
    first, second = (decoded(data) for data in collect(sender, 2))
    assert (first.frame_id, len(first) > 1000) == ("base_link", True)
    assert first.captured_at_s is not None
    assert second.captured_at_s == pytest.approx(first.captured_at_s + 0.2)
    world = shared_world(shared, 1).world
    before = first.xyz
    world.drive(0.0, 1.0)
    world.advance(1.0)
    turned = decoded(collect(sender, 1)[0]).xyz
    assert before.shape != turned.shape or not np.allclose(before, turned, atol=0.1)
