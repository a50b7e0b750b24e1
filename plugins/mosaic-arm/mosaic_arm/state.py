"""The ``arm-state`` connector: where the joints are, so many times a second."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

from pydantic import Field

from mosaic_arm.arm import Arm
from mosaic_arm.arm_configurer import ArmConfigurer
from mosaic_arm.arm_joint import ArmSnapshot
from mosaic_arm.params import PartParams
from mosaic_core import DataChannelSendable, Delivery
from mosaic_core.messages import JointState


class ArmStateParams(PartParams):
    rate_hz: float = Field(default=20.0, gt=0, le=200, description="Messages per second.")


class ArmState(DataChannelSendable[JointState]):
    """Sends angles and speeds of all joints as their encoders tell them. Efforts are not known: servos tell a share of
    their torque, which ``arm-health`` has."""

    delivery: ClassVar[Delivery] = Delivery.LATEST

    def __init__(self, label: str, arm: Arm, rate_hz: float) -> None:
        super().__init__(label)
        self._arm = arm
        self._period_s = 1 / rate_hz

    def messages(self) -> Iterator[JointState]:
        """Raises :class:`~mosaic_core.DeviceGone` while the bus is away."""
        for _ in self.every(self._period_s):
            snapshot = self._arm.snapshot
            if snapshot is not None:
                yield joint_state(snapshot)
            elif not self._arm.is_opening:
                raise self._arm.gone


def joint_state(snapshot: ArmSnapshot) -> JointState:
    return JointState(
        names=list(snapshot.angles_rad),
        positions=[round(angle, 5) for angle in snapshot.angles_rad.values()],
        velocities=[round(speed, 4) for speed in snapshot.speeds_radps.values()],
        timestamp=snapshot.stamp_us,
    )


class ArmStateConfigurer(ArmConfigurer[ArmStateParams]):
    """Sends the angles and speeds of an arm's joints."""

    connector_type = "arm-state"
    example: ClassVar[dict[str, Any] | None] = {"arm": {"port": "/dev/ttyACM0"}, "rate_hz": 20}

    def configure(self) -> ArmState:
        return ArmState(self.label, self.arm, self.params.rate_hz)
