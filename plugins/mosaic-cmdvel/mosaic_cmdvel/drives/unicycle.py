"""Drive ``unicycle``: a base with two driven wheels, whose motor controller takes wheel speeds over a serial line."""

from __future__ import annotations

import logging
from types import TracebackType
from typing import Literal, Self

from pydantic import Field, model_validator

from mosaic_cmdvel.drive import Drive, DriveParams
from mosaic_cmdvel.drives.wheel_line import WheelPort
from mosaic_cmdvel.kinematics import DifferentialBase, WheelSpeeds, saturated
from mosaic_core.contract.devices.shared import Shared
from mosaic_core.messages import Twist

_log = logging.getLogger(__name__)


class UnicycleParams(DriveParams):
    type: Literal["unicycle"]
    wheel_radius_m: float = Field(gt=0, le=5, description="Radius of the driven wheels.")
    track_width_m: float = Field(gt=0, le=20, description="Distance between the two wheels' contact points.")
    max_wheel_radps: float | None = Field(
        default=None, gt=0, description="Fastest wheel speed; both wheels are slowed alike, the curve stays."
    )
    output: Literal["serial", "log"] = Field(default="serial", description="Where the wheel speeds go.")
    port: str | None = Field(default=None, description="Serial port of the motor controller: /dev/ttyACM0.")
    baud: int = Field(default=115_200, gt=0, description="Speed of the serial port.")

    @model_validator(mode="after")
    def _serial_needs_a_port(self) -> Self:
        if self.output == "serial" and not self.port:
            raise ValueError("output serial needs a port, for example /dev/ttyACM0 (or write output: log)")
        return self


class UnicycleDrive(Drive[UnicycleParams]):
    """Turns forward speed and yaw into left and right wheel speeds. Sideways speed is ignored: it can't be driven."""

    def __init__(self, params: UnicycleParams, shared: Shared) -> None:
        super().__init__(params, shared)
        self._base = DifferentialBase(params.wheel_radius_m, params.track_width_m)
        self._port: WheelPort | None = None
        self._logged = WheelSpeeds(0.0, 0.0)

    def __enter__(self) -> Self:
        if self.params.port is not None and self.params.output == "serial":
            self._port = WheelPort(self.params.port, self.params.baud)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        port, self._port = self._port, None
        if port is not None:
            port.close()

    def apply(self, twist: Twist) -> None:
        wheels = self._base.wheels(twist)
        if self.params.max_wheel_radps is not None:
            wheels = saturated(wheels, self.params.max_wheel_radps)
        if self.params.output == "log":
            self._log_change(wheels)
        else:
            self._open_port().send(wheels)

    def stop(self) -> None:
        if self.params.output == "log":
            self._log_change(WheelSpeeds(0.0, 0.0))
        else:
            self._open_port().send_stop()

    def _open_port(self) -> WheelPort:
        if self._port is None:
            raise ConnectionError(f"{self.params.port} is closed")
        return self._port

    def _log_change(self, wheels: WheelSpeeds) -> None:
        if wheels != self._logged:
            self._logged = wheels
            _log.info("wheels: left %.2f rad/s, right %.2f rad/s", wheels.left_radps, wheels.right_radps)
