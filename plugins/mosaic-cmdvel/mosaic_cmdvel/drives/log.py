"""Drive ``log``: moves nothing and logs what would move, for trying a configuration out."""

from __future__ import annotations

import logging
from typing import Literal

from pydantic import Field

from mosaic_cmdvel.drive import Drive, DriveParams
from mosaic_core.contract.devices.shared import Shared
from mosaic_core.messages import STANDSTILL, Twist

_log = logging.getLogger(__name__)


class LogParams(DriveParams):
    type: Literal["log"]
    step_mps: float = Field(default=0.1, gt=0, description="Changes smaller than this, in m/s or rad/s, aren't logged.")


class LogDrive(Drive[LogParams]):
    """Logs every start, stop and noticeable change of the velocity."""

    def __init__(self, params: LogParams, shared: Shared) -> None:
        super().__init__(params, shared)
        self._logged = STANDSTILL

    def apply(self, twist: Twist) -> None:
        if self._differs(twist):
            self._logged = twist
            _log.info("x %.2f m/s, y %.2f m/s, yaw %.2f rad/s", twist.linear.x, twist.linear.y, twist.angular.z)

    def stop(self) -> None:
        self.apply(STANDSTILL)

    def _differs(self, twist: Twist) -> bool:
        if (twist == STANDSTILL) != (self._logged == STANDSTILL):
            return True
        old, step = self._logged, self.params.step_mps
        return (
            abs(twist.linear.x - old.linear.x) >= step
            or abs(twist.linear.y - old.linear.y) >= step
            or abs(twist.angular.z - old.angular.z) >= step
        )
