"""The ``mavlink-velocity`` connector: an operator's velocity to a vehicle in its guided mode."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import Field, field_validator
from pymavlink.dialects.v20 import ardupilotmega as words

from mosaic_core.contract.handler import DataChannelReceivable, Refused
from mosaic_core.contract.host import Sender
from mosaic_core.messages import STANDSTILL, Twist
from mosaic_core.words.config import SafetyConfig
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.limits import FieldLimit
from mosaic_core.words.safety_config import SafePolicy
from mosaic_mavlink.control.loss import LossGuard, MotionParams, not_kept
from mosaic_mavlink.link.contact import VehicleContact
from mosaic_mavlink.link.flight_modes import follows_velocities, guided_mode
from mosaic_mavlink.link.outgoing import OutgoingMessage
from mosaic_mavlink.link.vehicle_configurer import EXAMPLE, VehicleConfigurer
from mosaic_mavlink.telemetry.frames import flu_of_frd

HORIZONTAL = ("linear.x", "linear.y")
VERTICAL = ("linear.z",)
TURNING = ("angular.z",)
ONLY_VELOCITIES = 0b010111000111
"""``POSITION_TARGET_TYPEMASK``: no position, no acceleration, no yaw; velocities and the rate of yaw count."""


class MavlinkVelocitySafety(SafetyConfig):
    """The limits of a vehicle that is driven by velocities. The time-out can't be switched off."""

    timeout_s: float = Field(default=0.5, gt=0, le=3, description="Silence after which it stands still.")
    requires_lease: bool = Field(default=True, description="Take commands only from the lease's holder.")
    max_horizontal_mps: float = Field(default=2.0, gt=0, le=50, description="Fastest along the ground, in m/s.")
    max_vertical_mps: float = Field(default=1.0, gt=0, le=20, description="Fastest up and down, in m/s.")
    max_turning_radps: float = Field(default=1.0, gt=0, le=10, description="Fastest turn, in rad/s.")
    max_acceleration_mps2: float | None = Field(
        default=2.0, gt=0, le=50, description="Fastest gain of speed along the ground, in m/s²."
    )

    @field_validator("on_timeout", "on_loss")
    @classmethod
    def _stands_in_the_end(cls, policy: SafePolicy | None) -> SafePolicy | None:
        return not_kept(policy)

    def field_limits(self) -> tuple[FieldLimit, ...]:
        """Along the ground as a vector: too fast keeps its direction."""
        return (
            FieldLimit(HORIZONTAL, max_norm=self.max_horizontal_mps, max_rise_per_s=self.max_acceleration_mps2),
            FieldLimit(VERTICAL, max_norm=self.max_vertical_mps),
            FieldLimit(TURNING, max_norm=self.max_turning_radps),
        )


def velocity_message(twist: Twist) -> OutgoingMessage:
    """A ``SET_POSITION_TARGET_LOCAL_NED`` of a velocity in the vehicle's own axes."""
    vx, vy, vz = flu_of_frd(twist.linear.x, twist.linear.y, twist.linear.z)
    unused = dict.fromkeys(("x", "y", "z", "afx", "afy", "afz", "yaw"), 0.0)
    return "set_position_target_local_ned", {
        "time_boot_ms": 0, "coordinate_frame": words.MAV_FRAME_BODY_NED, "type_mask": ONLY_VELOCITIES, **unused,
        "vx": vx, "vy": vy, "vz": vz, "yaw_rate": -twist.angular.z,
    }  # fmt: skip


STILL = velocity_message(STANDSTILL)


class MavlinkVelocity(DataChannelReceivable[Twist]):
    """Moves an armed vehicle in GUIDED or OFFBOARD. It never arms it, and enters no mode but that of ``on_loss``."""

    delivery: ClassVar[Delivery] = Delivery.LATEST
    widget: ClassVar[str | None] = "drive-pad"
    motion_fields: ClassVar[tuple[str, ...]] = (*HORIZONTAL, *VERTICAL, *TURNING)

    def __init__(
        self, label: str, contact: VehicleContact, params: MotionParams, safety: MavlinkVelocitySafety
    ) -> None:
        super().__init__(label)
        self.timeout_s = safety.timeout_s
        self.requires_lease = safety.requires_lease
        self._contact, self.keeper = contact, contact.link.keeper
        self._guard = LossGuard(contact, params, safety.timeout_s)

    def handle_data(self, data: Twist, sender: Sender) -> None:
        """Receiver's thread."""
        facts = self._contact.facts()
        if not follows_velocities(facts.kind):
            cure = "fly it by sticks (mavlink-manual), modes (mavlink-command) or a mission (mavlink-mission)"
            raise Refused("mavlink.no_such_action", f"a {facts.kind} follows no velocities; {cure}")
        self._guard.check(facts)
        wanted = guided_mode(facts.kind)
        if facts.mode != wanted:
            raise Refused("mavlink.wrong_mode", f"the vehicle is in {facts.mode}, and takes this in {wanted}")
        if data.angular.x or data.angular.y:
            raise Refused("mavlink.no_such_axis", "a vehicle turns around z alone; leave angular.x and angular.y out")
        message = velocity_message(data)
        self._guard.send(message, facts.mode, sender.peer_id, moves=data != STANDSTILL)

    def make_safe(self, cause: str) -> None:
        """Safety thread."""
        self._guard.make_safe(STILL, cause)

    def peer_left(self, sender: Sender) -> None:
        """Safety thread. Who only watched may leave."""
        if self._guard.is_commander(sender.peer_id):
            self._guard.make_safe(STILL, "safety.peer_left")


class MavlinkVelocityConfigurer(VehicleConfigurer[MotionParams]):
    """Moves an ArduPilot or PX4 vehicle by velocities; on loss it stands still, then holds, returns or lands."""

    connector_type = "mavlink-velocity"
    safety_model = MavlinkVelocitySafety
    example: ClassVar[dict[str, Any] | None] = {**EXAMPLE, "on_loss": "hold"}

    def configure(self) -> MavlinkVelocity:
        safety = MavlinkVelocitySafety.model_validate(self.safety.model_dump())
        return MavlinkVelocity(self.label, self.contact, self.params, safety)
