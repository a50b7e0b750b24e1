"""The ``mavlink-odometry`` connector: where a vehicle is, how it lies and how it moves."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from mosaic_core.messages import Odometry
from mosaic_mavlink.link.contact import VehicleContact
from mosaic_mavlink.link.vehicle_configurer import VehicleConfigurer
from mosaic_mavlink.params import TelemetryParams
from mosaic_mavlink.telemetry.conversions import global_odometry, local_odometry
from mosaic_mavlink.telemetry.telemetry import Telemetry


class OdometryParams(TelemetryParams):
    position: Literal["local", "global"] = Field(
        default="local",
        description="local: from where the autopilot's estimator began; global: by satellites, from home, or from the "
        "first place that is heard.",
    )


class MavlinkOdometry(Telemetry[Odometry]):
    """Sends a position of ``LOCAL_POSITION_NED`` or ``GLOBAL_POSITION_INT`` with the newest attitude."""

    def __init__(self, label: str, contact: VehicleContact, params: OdometryParams) -> None:
        super().__init__(label, contact, params.period_s)
        self._is_global = params.position == "global"
        self._kind = "GLOBAL_POSITION_INT" if self._is_global else "LOCAL_POSITION_NED"
        self.asks_for = (self._kind, "ATTITUDE", *(("HOME_POSITION",) if self._is_global else ()))
        self._first: tuple[float, float] | None = None

    def reading(self) -> Odometry | None:
        turning, position = self.latest("ATTITUDE"), self.latest(self._kind)
        if turning is None or position is None or self.fresh(self._kind) is None:
            return None
        if not self._is_global:
            return local_odometry(position.message, turning.message, position.stamp_us)
        return global_odometry(position.message, turning.message, self._home(position.message), position.stamp_us)

    def _home(self, position: Any) -> tuple[float, float]:
        home = self.latest("HOME_POSITION")
        if home is not None:
            return home.message.latitude / 1e7, home.message.longitude / 1e7
        if self._first is None:
            self._first = position.lat / 1e7, position.lon / 1e7
        return self._first


class MavlinkOdometryConfigurer(VehicleConfigurer[OdometryParams]):
    """Position, attitude and velocity of an ArduPilot or PX4 vehicle."""

    connector_type = "mavlink-odometry"

    def configure(self) -> MavlinkOdometry:
        return MavlinkOdometry(self.label, self.contact, self.params)
