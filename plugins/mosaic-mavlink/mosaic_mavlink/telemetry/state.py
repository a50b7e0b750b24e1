"""The connectors ``mavlink-state`` and ``mavlink-diagnostic``: what a vehicle is doing, and how it is."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import Field

from mosaic_core.contract.params import Message, unit
from mosaic_core.messages import Diagnostic
from mosaic_mavlink.link.codec import named
from mosaic_mavlink.link.flight_modes import modes_of
from mosaic_mavlink.link.vehicle_configurer import VehicleConfigurer
from mosaic_mavlink.params import VehicleParams
from mosaic_mavlink.telemetry.telemetry import Telemetry

PERIOD_S = 0.5
_LANDED: dict[int, Literal["on_ground", "in_air", "taking_off", "landing"]] = {
    1: "on_ground", 2: "in_air", 3: "taking_off", 4: "landing",
}  # fmt: skip
_ERRORS = {"critical", "emergency", "flight_termination"}


class VehicleState(Message):
    """What a vehicle is doing."""

    schema_id: ClassVar[str] = "mosaic-mavlink/VehicleState@1"
    armed: bool = Field(description="Its motors may turn.")
    mode: str = Field(description="Flight mode, as the autopilot's people call it.")
    status: str = Field(description="MAV_STATE: standby, active, critical, emergency, …")
    landed: Literal["on_ground", "in_air", "taking_off", "landing"] | None = Field(
        default=None, description="Where the autopilot tells it."
    )
    system_id: int
    autopilot: str = Field(description="Such as ardupilotmega or px4.")
    vehicle_type: str = Field(description="Such as quadrotor or ground_rover.")
    modes: list[str] = Field(description="The modes that may be asked for.")
    heartbeat_age_s: float = Field(json_schema_extra=unit("s"), description="Since it last beat.")


class MavlinkState(Telemetry[VehicleState]):
    """Sends mode, arming and status twice a second."""

    widget: ClassVar[str | None] = "value-cards"
    asks_for = ("EXTENDED_SYS_STATE",)

    def reading(self) -> VehicleState | None:
        facts, extended = self.contact.vehicle.facts, self.latest("EXTENDED_SYS_STATE")
        if facts is None:
            return None
        return VehicleState(
            armed=facts.armed,
            mode=facts.mode,
            status=facts.status,
            landed=_LANDED.get(extended.message.landed_state) if extended is not None else None,
            system_id=facts.system_id,
            autopilot=facts.autopilot,
            vehicle_type=facts.vehicle_type,
            modes=list(modes_of(facts.kind)),
            heartbeat_age_s=round(max(0.0, self.contact.now_s() - facts.heard_at_s), 3),
        )


def failing_parts(message: Any) -> tuple[str, ...]:
    """The parts that a ``SYS_STATUS`` has switched on and finds unwell."""
    unwell = message.onboard_control_sensors_enabled & ~message.onboard_control_sensors_health
    bits = (1 << place for place in range(31) if unwell >> place & 1)  # the last bit says that there are more
    return tuple(_part(bit) for bit in bits)


def _part(bit: int) -> str:
    name = named("MAV_SYS_STATUS_SENSOR", bit)
    return name.removeprefix("mav_sys_status_").replace("_", " ")


def diagnostic_of(message: Any, status: str, mode: str, stamp_us: int) -> Diagnostic:
    """How a vehicle is, by its ``SYS_STATUS`` and its heartbeat's status."""
    unwell = failing_parts(message)
    said = ", ".join(filter(None, (status if status in _ERRORS else "", *unwell)))
    return Diagnostic(
        level="error" if status in _ERRORS else "warn" if unwell else "ok",
        name="vehicle",
        message=said,
        values={
            "mode": mode,
            "status": status,
            "load": f"{message.load / 10:.1f} %",
            "radio loss": f"{message.drop_rate_comm / 100:.2f} %",
            "radio errors": f"{message.errors_comm}",
        },
        timestamp=stamp_us,
    )


class MavlinkDiagnostic(Telemetry[Diagnostic]):
    """Sends which parts of the vehicle are unwell."""

    asks_for = ("SYS_STATUS",)

    def reading(self) -> Diagnostic | None:
        facts, heard = self.contact.vehicle.facts, self.fresh("SYS_STATUS")
        if facts is None or heard is None:
            return None
        return diagnostic_of(heard.message, facts.status, facts.mode, heard.stamp_us)


class MavlinkStateConfigurer(VehicleConfigurer[VehicleParams]):
    """Mode, arming and status of an ArduPilot or PX4 vehicle."""

    connector_type = "mavlink-state"

    def configure(self) -> MavlinkState:
        return MavlinkState(self.label, self.contact, PERIOD_S)


class MavlinkDiagnosticConfigurer(VehicleConfigurer[VehicleParams]):
    """Which parts of an ArduPilot or PX4 vehicle are unwell."""

    connector_type = "mavlink-diagnostic"

    def configure(self) -> MavlinkDiagnostic:
        return MavlinkDiagnostic(self.label, self.contact, PERIOD_S)
