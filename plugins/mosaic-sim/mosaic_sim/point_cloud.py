"""`sim-point-cloud`: a lidar with many rings on the simulated robot."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from mosaic_core import DataChannelConfigurer
from mosaic_core.contract.handler import Handler
from mosaic_sensors.point_cloud import PointCloud, PointCloudParams, PointCloudSender, cloud_of
from mosaic_sim.laser_scan import REFLECTANCE
from mosaic_sim.live_world import LiveWorld, SimParams, shared_world
from mosaic_sim.motion import Motion
from mosaic_sim.raycast import cast
from mosaic_sim.room import Floats, Material, Room

SENSOR_HEIGHT_M = 0.45
"""Below the lowest obstacle's top, so that no top face is ever seen."""
_COLOURS = np.zeros((len(Material) + 1, 3), dtype=np.uint8)
_COLOURS[[Material.NORTH, Material.EAST, Material.SOUTH, Material.WEST]] = (
    (84, 128, 168), (184, 96, 78), (98, 150, 96), (200, 158, 84),
)  # fmt: skip
_COLOURS[[Material.DIVIDER, Material.PILLAR, Material.CRATE]] = (172, 178, 186), (160, 156, 150), (178, 136, 84)
_COLOURS[[Material.BARREL_RED, Material.BARREL_BLUE, Material.CONE]] = (198, 48, 52), (40, 112, 186), (236, 128, 40)
_GROUND = len(Material)
_COLOURS[_GROUND] = (124, 126, 128)
_GROUND_REFLECTANCE = 0.4


class SimPointCloudParams(SimParams, PointCloudParams):
    rate_hz: float = Field(default=5.0, gt=0, le=30, description="Turns per second.")
    columns: int = Field(default=480, ge=16, le=4096, description="Directions of one turn.")
    rings: int = Field(default=32, ge=2, le=128, description="Rays above each other.")
    lowest_deg: float = Field(default=-25.0, ge=-80, le=0, description="Elevation of the lowest ring.")
    highest_deg: float = Field(default=20.0, gt=0, le=80, description="Elevation of the highest ring.")
    reach_m: float = Field(default=15.0, gt=0, description="Farther things give no return.")
    noise_m: float = Field(default=0.008, ge=0, description="Standard deviation of each distance.")


class Lidar:
    """Looks from a place in a room; points are relative to the robot on the ground, x ahead (REP-103)."""

    def __init__(self, room: Room, params: SimPointCloudParams) -> None:
        self._room = room
        self._reach_m = params.reach_m
        self._noise_m = params.noise_m
        self._bearings_rad = np.arange(params.columns) * (2 * math.pi / params.columns) - math.pi
        rings = np.radians(np.linspace(params.lowest_deg, params.highest_deg, params.rings))
        self._slopes = np.tan(rings)[:, None]
        self._lengths = 1.0 / np.cos(rings)[:, None]
        """Of a ray per metre over the ground."""

    def look(self, motion: Motion, noise: np.random.Generator) -> PointCloud:
        """All returns of one turn, ring after ring."""
        angles = motion.yaw_rad + self._bearings_rad
        directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        place = (motion.x_m, motion.y_m)
        level_m = np.full((len(self._slopes), len(angles)), np.inf)
        material = np.zeros(level_m.shape, dtype=np.intp)
        intensity = np.zeros(level_m.shape)
        for is_tall, height_m in ((True, self._room.wall_height_m), (False, self._room.low_height_m)):
            hits = cast(self._room, place, directions, tall=is_tall)
            with np.errstate(invalid="ignore"):
                at_m = SENSOR_HEIGHT_M + hits.distance * self._slopes
                is_hit = (at_m >= 0.0) & (at_m <= height_m) & (hits.distance < level_m)
            level_m = np.where(is_hit, hits.distance, level_m)
            material = np.where(is_hit, hits.material, material)
            intensity = np.where(is_hit, REFLECTANCE[hits.material] * hits.facing, intensity)
        self._see_ground(level_m, material, intensity)
        return self._returns(level_m, material, intensity, noise)

    def _see_ground(self, level_m: Floats, material: NDArray[np.intp], intensity: Floats) -> None:
        with np.errstate(divide="ignore"):
            ground_m = np.where(self._slopes < 0, -SENSOR_HEIGHT_M / self._slopes, np.inf)
        is_ground = np.broadcast_to(ground_m, level_m.shape) < level_m
        level_m[is_ground] = np.broadcast_to(ground_m, level_m.shape)[is_ground]
        material[is_ground] = _GROUND
        shade = _GROUND_REFLECTANCE * np.abs(self._slopes) / self._lengths
        intensity[is_ground] = np.broadcast_to(shade, level_m.shape)[is_ground]

    def _returns(
        self,
        level_m: Floats,
        material: NDArray[np.intp],
        intensity: Floats,
        noise: np.random.Generator,
    ) -> PointCloud:
        ray_m = level_m * self._lengths
        seen = ray_m <= self._reach_m
        rings, columns = np.nonzero(seen)
        ray_m = ray_m[seen] + noise.normal(0.0, self._noise_m, len(rings))
        over_ground_m = ray_m / self._lengths[rings, 0]
        bearing = self._bearings_rad[columns]
        xyz = np.empty((len(rings), 3), dtype=np.float32)
        xyz[:, 0] = over_ground_m * np.cos(bearing)
        xyz[:, 1] = over_ground_m * np.sin(bearing)
        xyz[:, 2] = SENSOR_HEIGHT_M + over_ground_m * self._slopes[rings, 0]
        return cloud_of(xyz, intensity=intensity[seen].astype(np.float32), rgb=_COLOURS[material[seen]])


class SimPointCloud(PointCloudSender):
    def __init__(self, label: str, params: SimPointCloudParams, world: LiveWorld) -> None:
        super().__init__(label, params)
        self._params = params
        self._world = world

    def clouds(self) -> Iterator[PointCloud]:
        lidar = Lidar(self._world.world.room, self._params)
        noise = self._world.world.noise(self.label)
        for _ in self.every(1.0 / self._params.rate_hz):
            captured_at_s = self.monotonic_s()
            cloud = lidar.look(self._world.state.motion, noise)
            yield replace(cloud, frame_id="base_link", captured_at_s=captured_at_s)


class SimPointCloudConfigurer(DataChannelConfigurer[SimPointCloudParams]):
    """Point cloud of a turning lidar on the simulated robot."""

    connector_type = "sim-point-cloud"

    def configure(self) -> Sequence[Handler]:
        return SimPointCloud(self.label, self.params, shared_world(self.shared, self.params.seed)).handlers()
