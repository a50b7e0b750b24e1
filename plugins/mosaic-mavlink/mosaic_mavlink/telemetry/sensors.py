"""The connectors of single sensors of a vehicle: ``mavlink-imu``, ``-gps``, ``-range`` and ``-battery``."""

from __future__ import annotations

from pydantic import Field

from mosaic_core.contract.params import unit
from mosaic_core.messages import BatteryState, GpsFix, Imu, Range
from mosaic_mavlink.link.contact import VehicleContact
from mosaic_mavlink.link.vehicle_configurer import VehicleConfigurer
from mosaic_mavlink.params import TelemetryParams
from mosaic_mavlink.telemetry.conversions import (
    battery_of,
    battery_of_system,
    gps_of,
    imu_of,
    orientation_of,
    range_of,
    range_of_finder,
)
from mosaic_mavlink.telemetry.telemetry import Telemetry

_IMU_KINDS = ("HIGHRES_IMU", "SCALED_IMU", "RAW_IMU")


class SlowTelemetryParams(TelemetryParams):
    period_s: float = Field(default=1.0, ge=0.02, le=60, description="Seconds between two messages, asked of it.")


class RangeParams(TelemetryParams):
    sensor_id: int = Field(default=0, ge=0, le=255, description="Which distance sensor of the vehicle.")
    max_m: float = Field(
        default=100.0, gt=0, json_schema_extra=unit("m"), description="Of a RANGEFINDER, which tells no limit."
    )


class BatteryParams(SlowTelemetryParams):
    battery_id: int = Field(default=0, ge=0, le=255, description="Which battery of the vehicle.")


class MavlinkImu(Telemetry[Imu]):
    """Sends the first inertial unit, in SI units, with the autopilot's attitude."""

    asks_for = ("HIGHRES_IMU", "SCALED_IMU", "ATTITUDE")

    def reading(self) -> Imu | None:
        attitude = self.latest("ATTITUDE")
        for kind in _IMU_KINDS:
            if self.latest(kind) is not None:
                heard = self.fresh(kind)
                orientation = orientation_of(attitude.message) if attitude is not None else None
                return None if heard is None else imu_of(heard.message, orientation, heard.stamp_us)
        return None


class MavlinkGps(Telemetry[GpsFix]):
    """Sends what the first satellite receiver says."""

    asks_for = ("GPS_RAW_INT",)

    def reading(self) -> GpsFix | None:
        heard = self.fresh("GPS_RAW_INT")
        return None if heard is None else gps_of(heard.message, heard.stamp_us)


class MavlinkRange(Telemetry[Range]):
    """Sends one distance sensor, or ArduPilot's rangefinder where there is no such sensor."""

    asks_for = ("DISTANCE_SENSOR", "RANGEFINDER")

    def __init__(self, label: str, contact: VehicleContact, params: RangeParams) -> None:
        super().__init__(label, contact, params.period_s)
        self._key = f"DISTANCE_SENSOR:{params.sensor_id}"
        self._max_m = params.max_m

    def reading(self) -> Range | None:
        if self.latest(self._key) is not None:
            heard = self.fresh(self._key)
            return None if heard is None else range_of(heard.message, heard.stamp_us)
        heard = self.fresh("RANGEFINDER")
        return None if heard is None else range_of_finder(heard.message, self._max_m, heard.stamp_us)


class MavlinkBattery(Telemetry[BatteryState]):
    """Sends one battery; the first one also where the vehicle tells only the state of its system."""

    asks_for = ("BATTERY_STATUS", "SYS_STATUS")

    def __init__(self, label: str, contact: VehicleContact, params: BatteryParams) -> None:
        super().__init__(label, contact, params.period_s)
        self._key = f"BATTERY_STATUS:{params.battery_id}"
        self._is_first = params.battery_id == 0

    def reading(self) -> BatteryState | None:
        if self.latest(self._key) is not None or not self._is_first:
            heard = self.fresh(self._key)
            return None if heard is None else battery_of(heard.message, heard.stamp_us)
        heard = self.fresh("SYS_STATUS")
        return None if heard is None else battery_of_system(heard.message, heard.stamp_us)


class MavlinkImuConfigurer(VehicleConfigurer[TelemetryParams]):
    """Rotation rates, accelerations and attitude of an ArduPilot or PX4 vehicle."""

    connector_type = "mavlink-imu"

    def configure(self) -> MavlinkImu:
        return MavlinkImu(self.label, self.contact, self.params.period_s)


class MavlinkGpsConfigurer(VehicleConfigurer[SlowTelemetryParams]):
    """The satellite fix of an ArduPilot or PX4 vehicle."""

    connector_type = "mavlink-gps"

    def configure(self) -> MavlinkGps:
        return MavlinkGps(self.label, self.contact, self.params.period_s)


class MavlinkRangeConfigurer(VehicleConfigurer[RangeParams]):
    """A distance sensor of an ArduPilot or PX4 vehicle."""

    connector_type = "mavlink-range"

    def configure(self) -> MavlinkRange:
        return MavlinkRange(self.label, self.contact, self.params)


class MavlinkBatteryConfigurer(VehicleConfigurer[BatteryParams]):
    """A battery of an ArduPilot or PX4 vehicle."""

    connector_type = "mavlink-battery"

    def configure(self) -> MavlinkBattery:
        return MavlinkBattery(self.label, self.contact, self.params)
