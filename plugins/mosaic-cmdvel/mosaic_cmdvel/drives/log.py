"""Drive ``log``: moves nothing and logs what would move, for trying a configuration out."""

from __future__ import annotations

import logging
from typing import Literal

from pydantic import Field

from mosaic_cmdvel.drive import Drive, DriveParams
from mosaic_cmdvel.twist import STANDSTILL, Twist
from mosaic_core.contract.configurer import Shared

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
            _log.info(
                "x %.2f m/s, y %.2f m/s, yaw %.2f rad/s", twist.linear_x_mps, twist.linear_y_mps, twist.angular_z_radps
            )

    def stop(self) -> None:
        self.apply(STANDSTILL)

    def _differs(self, twist: Twist) -> bool:
        if twist.is_zero != self._logged.is_zero:
            return True
        old, step = self._logged, self.params.step_mps
        return (
            abs(twist.linear_x_mps - old.linear_x_mps) >= step
            or abs(twist.linear_y_mps - old.linear_y_mps) >= step
            or abs(twist.angular_z_radps - old.angular_z_radps) >= step
        )
