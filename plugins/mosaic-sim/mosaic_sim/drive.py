"""The drive `sim`: moves the simulated robot that the sim-* connectors look at."""

from __future__ import annotations

from pydantic import Field

from mosaic_cmdvel import Drive, DriveParams
from mosaic_core import Shared
from mosaic_core.messages import Twist
from mosaic_sim.live_world import shared_world


class SimDriveParams(DriveParams):
    seed: int = Field(default=1, ge=0, description="Connectors and drives of one seed share one world.")


class SimDrive(Drive[SimDriveParams]):
    """The wheels of the simulated robot: takes linear x and angular z, limited by its motors."""

    def __init__(self, params: SimDriveParams, shared: Shared) -> None:
        super().__init__(params, shared)
        self._world = shared_world(shared, params.seed).world

    def apply(self, twist: Twist) -> None:
        self._world.drive(twist.linear.x, twist.angular.z)

    def stop(self) -> None:
        self._world.drive(0.0, 0.0)
