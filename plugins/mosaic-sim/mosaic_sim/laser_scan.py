"""`sim-laser-scan`: a planar laser scanner on the simulated robot, with the keys that MOSAIC's scan widgets read."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from pydantic import Field

from mosaic_core import DataChannelConfigurer, DataChannelSendable, Delivery
from mosaic_core.messages import LaserScan
from mosaic_sim.live_world import LiveWorld, SimParams, shared_world
from mosaic_sim.motion import Motion
from mosaic_sim.raycast import cast
from mosaic_sim.room import Floats, Material, Room

REFLECTANCE = np.full(len(Material), 0.7)
REFLECTANCE[[Material.BARREL_RED, Material.CONE]] = 0.95
REFLECTANCE[[Material.CRATE, Material.DIVIDER]] = 0.5


class SimLaserScanParams(SimParams):
    period_s: float = Field(default=0.1, gt=0, le=60, description="Seconds between two scans.")
    rays: int = Field(default=360, ge=8, le=2048, description="Rays per turn.")
    range_min_m: float = Field(default=0.12, ge=0, description="Nearer things give no return.")
    range_max_m: float = Field(default=8.0, gt=0, description="Farther things give no return.")
    noise_m: float = Field(default=0.008, ge=0, description="Standard deviation of each range.")


def scanned(room: Room, motion: Motion, rays: int) -> tuple[Floats, Floats]:
    """True ranges in metres (``inf``: nothing there) and intensities for ``rays`` evenly spread around the robot."""
    angles = motion.yaw_rad + np.arange(rays) * (2 * math.pi / rays) - math.pi
    hits = cast(room, (motion.x_m, motion.y_m), np.stack([np.cos(angles), np.sin(angles)], axis=1))
    return hits.distance, REFLECTANCE[hits.material] * hits.facing


class SimLaserScan(DataChannelSendable[LaserScan]):
    delivery = Delivery.LATEST

    def __init__(self, label: str, params: SimLaserScanParams, world: LiveWorld) -> None:
        super().__init__(label)
        self._params = params
        self._world = world

    def messages(self) -> Iterator[LaserScan]:
        noise = self._world.world.noise(self.label)
        for _ in self.every(self._params.period_s):
            yield self._measured(noise)

    def _measured(self, noise: np.random.Generator) -> LaserScan:
        params = self._params
        true_m, intensities = scanned(self._world.world.room, self._world.state.motion, params.rays)
        ranges = true_m + noise.normal(0.0, params.noise_m, params.rays)
        is_seen = (ranges >= params.range_min_m) & (ranges <= params.range_max_m)
        increment_rad = 2 * math.pi / params.rays
        return LaserScan(
            angle_min=-math.pi,
            angle_max=math.pi - increment_rad,
            angle_increment=increment_rad,
            time_increment=params.period_s / params.rays,
            scan_time=params.period_s,
            range_min=params.range_min_m,
            range_max=params.range_max_m,
            ranges=[round(r, 3) if seen else None for r, seen in zip(ranges.tolist(), is_seen.tolist(), strict=True)],
            intensities=np.round(np.where(is_seen, intensities, 0.0), 2).tolist(),
        )


class SimLaserScanConfigurer(DataChannelConfigurer[SimLaserScanParams]):
    """Planar laser scan around the simulated robot."""

    connector_type = "sim-laser-scan"

    def configure(self) -> SimLaserScan:
        return SimLaserScan(self.label, self.params, shared_world(self.shared, self.params.seed))
