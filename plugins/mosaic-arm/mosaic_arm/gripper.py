"""The ``arm-gripper`` connector: how far the gripper opens, in metres, and how hard it presses."""

from __future__ import annotations

from typing import ClassVar

from mosaic_arm.arm_configurer import ArmConfigurer
from mosaic_arm.arm_joint import ArmJoint
from mosaic_arm.joints import RESOURCE, TIMEOUT_S
from mosaic_arm.params import PartParams
from mosaic_arm.shared_arm import KeptArm
from mosaic_core import DataChannelReceivable, Delivery, FieldBounds
from mosaic_core.messages import GripperTarget
from mosaic_core.words.errors import MosaicError


class ArmGripper(DataChannelReceivable[GripperTarget]):
    """Opens and closes the gripper. Its opening is taken as even over its joint's range: 0 m at the least angle."""

    delivery: ClassVar[Delivery] = Delivery.LATEST
    timeout_s = TIMEOUT_S
    requires_lease = True
    resource = RESOURCE

    def __init__(self, label: str, arm: KeptArm, joint: ArmJoint) -> None:
        super().__init__(label)
        self._arm, self.keeper = arm, arm.keeper
        self._joint = joint
        self._opening_m = arm.params.gripper_opening_m
        self._force_n = arm.params.gripper_force_n
        self._m_per_rad = self._opening_m / (joint.high_rad - joint.low_rad)
        self.limits = {"position": FieldBounds(min=0.0, max=self._opening_m)}

    def reported_position(self, field: str) -> float | None:
        angle_rad = self._arm.standing_rad(self._joint.name)
        if angle_rad is None:
            return None
        opening_m = (angle_rad - self._joint.low_rad) * self._m_per_rad
        return min(max(opening_m, 0.0), self._opening_m)

    def handle_data(self, data: GripperTarget) -> None:
        """Receiver's thread."""
        angle_rad = self._joint.low_rad + data.position / self._m_per_rad
        percent = 100.0 if data.max_effort is None else min(100.0, 100 * data.max_effort / self._force_n)
        self._arm.aim({self._joint.name: angle_rad}, self, strength_percent=percent)

    def make_safe(self, cause: str) -> None:
        """Safety thread: what it holds stays held."""
        self._arm.make_safe(cause, self)


class ArmGripperConfigurer(ArmConfigurer[PartParams]):
    """Opens and closes the gripper of an arm of serial servos."""

    connector_type = "arm-gripper"

    def configure(self) -> ArmGripper:
        arm = self.arm
        if arm.params.gripper is None:
            cure = "Name the joint that it is: gripper: gripper."
            raise MosaicError(f"this arm has no gripper. {cure}", code="config.invalid", cure=cure)
        return ArmGripper(self.label, arm, arm.joints[arm.params.gripper])
