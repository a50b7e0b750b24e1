"""`sim-marks`: what stands in sight of the simulated camera, marked in its picture as a detector would."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from pydantic import Field

from mosaic_core import CameraLabel, DataChannelConfigurer, DataChannelSendable, Delivery, unit
from mosaic_core.messages import ImageAnnotations, ImageBox, wall_time_us
from mosaic_sim.live_world import LiveWorld, SimParams, shared_world
from mosaic_sim.motion import Motion
from mosaic_sim.raycast import cast
from mosaic_sim.renderer import CAMERA_HEIGHT_M
from mosaic_sim.room import Box, Material, Post, Room

FARTHEST_M = 6.0
NAMES = {Material.PILLAR: "pillar", Material.CRATE: "crate", Material.CONE: "cone"}


class SimMarksParams(SimParams):
    camera: CameraLabel = Field(description="The camera in whose picture they lie; the sizes are those of its params.")
    period_s: float = Field(default=0.1, gt=0, le=60, description="Seconds between two messages.")
    width: int = Field(default=640, ge=64, le=1920, description="Pixels.", json_schema_extra=unit("px"))
    height: int = Field(default=480, ge=48, le=1080, description="Pixels.", json_schema_extra=unit("px"))
    fov_deg: float = Field(default=75.0, ge=30, le=120, description="Horizontal field of view.")


class SimMarks(DataChannelSendable[ImageAnnotations]):
    delivery = Delivery.LATEST

    def __init__(self, label: str, params: SimMarksParams, world: LiveWorld) -> None:
        super().__init__(label)
        self._params = params
        self._world = world

    def messages(self) -> Iterator[ImageAnnotations]:
        params = self._params
        for _ in self.every(params.period_s):
            looked_at_s = self.monotonic_s()
            yield ImageAnnotations(
                camera=params.camera,
                width=params.width,
                height=params.height,
                boxes=list(boxes_in_sight(self._world.world.room, self._world.state.motion, params)),
                captured_at_us=int(looked_at_s * 1e6),
                timestamp=wall_time_us(),
            )


def boxes_in_sight(room: Room, motion: Motion, params: SimMarksParams) -> Iterator[ImageBox]:
    """A box around everything that stands alone, whose middle is in the picture and not behind something else."""
    focal_px = params.width / 2 / math.tan(math.radians(params.fov_deg) / 2)
    cos, sin = math.cos(motion.yaw_rad), math.sin(motion.yaw_rad)
    for solid in room.solids:
        if not isinstance(solid, Box | Post):
            continue
        dx, dy = solid.x_m - motion.x_m, solid.y_m - motion.y_m
        ahead_m, left_m = cos * dx + sin * dy, cos * dy - sin * dx
        half_m = solid.radius_m if isinstance(solid, Post) else solid.size_m * 0.6
        middle_px = params.width / 2 - left_m / max(ahead_m, 0.01) * focal_px
        if not (half_m < ahead_m < FARTHEST_M and 0 <= middle_px < params.width):
            continue
        if _is_hidden(room, motion, (dx, dy), math.hypot(dx, dy) - half_m):
            continue
        is_tall = isinstance(solid, Post) and solid.is_tall
        top_m = (room.wall_height_m if is_tall else room.low_height_m) - CAMERA_HEIGHT_M
        px_per_m = focal_px / (ahead_m - half_m)
        yield ImageBox(
            x=round(middle_px - half_m * px_per_m, 1),
            y=round(params.height / 2 - top_m * px_per_m, 1),
            width=round(2 * half_m * px_per_m, 1),
            height=round((top_m + CAMERA_HEIGHT_M) * px_per_m, 1),
            label=NAMES.get(solid.material, "barrel"),
            score=round(1 - ahead_m / (2 * FARTHEST_M), 2),
        )


def _is_hidden(room: Room, motion: Motion, towards: tuple[float, float], distance_m: float) -> bool:
    """Whether something else is met first on the straight way there."""
    direction = np.array([towards]) / math.hypot(*towards)
    return any(
        float(cast(room, (motion.x_m, motion.y_m), direction, tall=tall).distance[0]) < distance_m - 0.1
        for tall in (True, False)
    )


class SimMarksConfigurer(DataChannelConfigurer[SimMarksParams]):
    """What stands in sight of the simulated camera, as boxes in its picture."""

    connector_type = "sim-marks"
    example = {"camera": "front"}  # noqa: RUF012 - as the contract has it

    def configure(self) -> SimMarks:
        return SimMarks(self.label, self.params, shared_world(self.shared, self.params.seed))
