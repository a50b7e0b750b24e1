"""The ``mavlink-manual`` connector: an operator's sticks to a vehicle in one of its own piloted modes."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import Field, field_validator

from mosaic_core.contract.handler import DataChannelReceivable, Refused
from mosaic_core.contract.host import Sender
from mosaic_core.contract.params import Message, unit
from mosaic_core.words.config import SafetyConfig
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.safety_config import SafePolicy
from mosaic_mavlink.control.loss import LossGuard, MotionParams, not_kept
from mosaic_mavlink.link.contact import VehicleContact
from mosaic_mavlink.link.flight_modes import VehicleClass, stick_modes
from mosaic_mavlink.link.outgoing import OutgoingMessage
from mosaic_mavlink.link.vehicle_configurer import EXAMPLE, VehicleConfigurer

FULL = 1000
CENTRE = 500


def _stick(description: str) -> Any:
    return Field(default=0.0, ge=-1, le=1, strict=True, json_schema_extra=unit(""), description=description)


class ManualControl(Message):
    """Sticks from -1 to 1; 0 is the middle, in which a vehicle stays where it is."""

    schema_id: ClassVar[str] = "mosaic-mavlink/ManualControl@1"
    forward: float = _stick("1: forward as far as it goes.")
    left: float = _stick("1: to the left. A rover can't.")
    up: float = _stick("1: up. A rover can't.")
    turn_left: float = _stick("1: turn left.")


CENTRED = ManualControl()


def sticks_message(kind: VehicleClass, sticks: ManualControl) -> OutgoingMessage:
    """A ``MANUAL_CONTROL``. Sticks to the right are positive there; the throttle is 0 to 1000 with its middle at 500,
    but for ArduPilot's rovers, which steer by ``y`` and drive by ``z`` from -1000 to 1000."""
    axes = {
        "x": round(sticks.forward * FULL), "y": round(-sticks.left * FULL),
        "z": round(CENTRE + sticks.up * CENTRE), "r": round(-sticks.turn_left * FULL),
    }  # fmt: skip
    if kind == "rover":
        axes = {"x": 0, "y": round(-sticks.turn_left * FULL), "z": round(sticks.forward * FULL), "r": 0}
    return "manual_control", {**axes, "buttons": 0}


class MavlinkManualSafety(SafetyConfig):
    """The limits of a vehicle that is flown by sticks. The time-out can't be switched off."""

    timeout_s: float = Field(default=0.5, gt=0, le=2, description="Silence after which the sticks are centred.")
    requires_lease: bool = Field(default=True, description="Take sticks only from the lease's holder.")

    @field_validator("on_timeout", "on_loss")
    @classmethod
    def _is_let_go(cls, policy: SafePolicy | None) -> SafePolicy | None:
        return not_kept(policy)


class MavlinkManual(DataChannelReceivable[ManualControl]):
    """Moves the sticks of an armed vehicle, in modes that hold what is let go."""

    delivery: ClassVar[Delivery] = Delivery.LATEST
    motion_fields: ClassVar[tuple[str, ...]] = ("forward", "left", "up", "turn_left")

    def __init__(self, label: str, contact: VehicleContact, params: MotionParams, safety: MavlinkManualSafety) -> None:
        super().__init__(label)
        self.timeout_s = safety.timeout_s
        self.requires_lease = safety.requires_lease
        self._contact, self.keeper = contact, contact.link.keeper
        self._guard = LossGuard(contact, params, safety.timeout_s)

    def handle_data(self, data: ManualControl, sender: Sender) -> None:
        """Receiver's thread."""
        facts = self._contact.facts()
        self._guard.check(facts)
        wanted = stick_modes(facts.kind)
        if facts.mode not in wanted:
            known = ", ".join(sorted(wanted)) or "none that is known"
            raise Refused("mavlink.wrong_mode", f"the vehicle is in {facts.mode}; sticks are taken in {known}")
        message = sticks_message(facts.kind, data)
        self._guard.send(message, facts.mode, sender.peer_id, moves=data != CENTRED)

    def make_safe(self, cause: str) -> None:
        """Safety thread."""
        facts = self._contact.vehicle.facts
        if facts is not None:
            self._guard.make_safe(sticks_message(facts.kind, CENTRED), cause)

    def peer_left(self, sender: Sender) -> None:
        """Safety thread. Who only watched may leave."""
        if self._guard.is_commander(sender.peer_id):
            self.make_safe("safety.peer_left")


class MavlinkManualConfigurer(VehicleConfigurer[MotionParams]):
    """Moves the sticks of an ArduPilot or PX4 vehicle; on loss they are centred, then it holds, returns or lands."""

    connector_type = "mavlink-manual"
    safety_model = MavlinkManualSafety
    example: ClassVar[dict[str, Any] | None] = {**EXAMPLE, "on_loss": "hold"}

    def configure(self) -> MavlinkManual:
        safety = MavlinkManualSafety.model_validate(self.safety.model_dump())
        return MavlinkManual(self.label, self.contact, self.params, safety)
