"""`sim-map` and `sim-path`: the yard as a grid of cells, and the way from the robot to its charging pad."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

from pydantic import Field

from mosaic_core import DataChannelConfigurer, DataChannelSendable
from mosaic_core.messages import OccupancyGrid, Path, Point, Pose, Quaternion, wall_time_us
from mosaic_sim.live_world import LiveWorld, SimParams, shared_world
from mosaic_sim.reports.floor_plan import CELL_M, FloorPlan


class SimMapParams(SimParams):
    period_s: float = Field(default=30.0, gt=0, le=3600, description="Seconds between two messages.")


class SimMap(DataChannelSendable[OccupancyGrid]):
    """Who comes later gets the last one."""

    def __init__(self, label: str, params: SimMapParams, world: LiveWorld) -> None:
        super().__init__(label)
        self._params = params
        self._world = world

    def messages(self) -> Iterator[OccupancyGrid]:
        room = self._world.world.room
        plan = FloorPlan(room)
        cells = [100 if is_taken else 0 for is_taken in plan.occupied.ravel()]
        for _ in self.every(self._params.period_s):
            yield OccupancyGrid(
                resolution=CELL_M,
                width=plan.columns,
                height=plan.rows,
                origin=Pose(position=Point(x=-room.half_x_m, y=-room.half_y_m)),
                data=cells,
                timestamp=wall_time_us(),
            )


class SimMapConfigurer(DataChannelConfigurer[SimMapParams]):
    """The simulated yard as an occupancy grid."""

    connector_type = "sim-map"

    def configure(self) -> SimMap:
        return SimMap(self.label, self.params, shared_world(self.shared, self.params.seed))


class SimPathParams(SimParams):
    period_s: float = Field(default=1.0, gt=0, le=3600, description="Seconds between two messages.")


class SimPath(DataChannelSendable[Path]):
    def __init__(self, label: str, params: SimPathParams, world: LiveWorld) -> None:
        super().__init__(label)
        self._params = params
        self._world = world

    def messages(self) -> Iterator[Path]:
        room = self._world.world.room
        plan = FloorPlan(room)
        for _ in self.every(self._params.period_s):
            motion = self._world.state.motion
            way = plan.way((motion.x_m, motion.y_m), room.dock)
            yield Path(poses=_poses(way), timestamp=wall_time_us())


def _poses(way: list[tuple[float, float]]) -> list[Pose]:
    """Each looks to the next."""
    legs = [*pairwise(way), *([(way[-2], way[-1])] if len(way) > 1 else [])]
    return [
        Pose(
            position=Point(x=round(here[0], 3), y=round(here[1], 3)),
            orientation=Quaternion.of_yaw(math.atan2(end[1] - start[1], end[0] - start[0])),
        )
        for here, (start, end) in zip(way, legs, strict=False)
    ]


class SimPathConfigurer(DataChannelConfigurer[SimPathParams]):
    """The way from the simulated robot to its charging pad."""

    connector_type = "sim-path"

    def configure(self) -> SimPath:
        return SimPath(self.label, self.params, shared_world(self.shared, self.params.seed))
