"""The ``arm-joints`` connector: an operator's ``JointTarget`` to the arm; silence or a lost operator holds it still."""

from __future__ import annotations

from typing import ClassVar

from mosaic_arm.arm_configurer import ArmConfigurer
from mosaic_arm.params import PartParams
from mosaic_arm.shared_arm import KeptArm
from mosaic_core import DataChannelReceivable, Delivery, FieldBounds
from mosaic_core.messages import JointTarget

TIMEOUT_S = 0.3
"""Silence after which the arm stands, as a base does. A page says its target again until the arm is there, or nobody
looks any more."""
RESOURCE = "arm"
"""Whose lease moves an arm: one person may drive the base while another one grips."""


class ArmJoints(DataChannelReceivable[JointTarget]):
    """Moves joints, each within its angles. How smoothly is the arm's own affair: a target
    that is said three times within the time-out is enough to get there."""

    delivery: ClassVar[Delivery] = Delivery.LATEST
    timeout_s = TIMEOUT_S
    requires_lease = True
    resource = RESOURCE

    def __init__(self, label: str, arm: KeptArm) -> None:
        super().__init__(label)
        self._arm, self.keeper = arm, arm.keeper
        self.item_names = tuple(arm.joints)
        self.limits = {
            f"positions.{name}": FieldBounds(min=joint.low_rad, max=joint.high_rad)
            for name, joint in arm.joints.items()
        }

    def reported_position(self, field: str) -> float | None:
        return self._arm.standing_rad(field.removeprefix("positions."))

    def handle_data(self, data: JointTarget) -> None:
        """Receiver's thread."""
        self._arm.aim(dict(zip(data.names, data.positions, strict=True)), self, duration_s=data.duration_s)

    def make_safe(self, cause: str) -> None:
        """Safety thread: it stays where it is, and is not let go, for it would fall."""
        self._arm.make_safe(cause, self)


class ArmJointsConfigurer(ArmConfigurer[PartParams]):
    """Moves the joints of an arm of serial servos; it stands still on silence and when the operator leaves."""

    connector_type = "arm-joints"

    def configure(self) -> ArmJoints:
        return ArmJoints(self.label, self.arm)
