"""The ``arm-freedrive`` connector: lets the motors go, so that hands can move the arm, and powers them again."""

from __future__ import annotations

from pydantic import Field

from mosaic_arm.arm_configurer import ArmConfigurer
from mosaic_arm.joints import RESOURCE
from mosaic_arm.params import PartParams
from mosaic_arm.shared_arm import KeptArm
from mosaic_core import Message, Refused, Request, RequestHandler


class Freedrive(Message):
    """Whether the motors shall be off."""

    motors_off: bool = Field(description="Off: the arm FALLS with all its weight unless somebody holds it.")
    somebody_holds_the_arm: bool = Field(default=False, description="Say so to switch the motors off.")


class FreedriveAnswer(Message):
    """How it is now."""

    motors_off: bool
    message: str


class ArmFreedrive(RequestHandler[Freedrive, FreedriveAnswer]):
    """Switches all motors off and on. Switched on, the arm stays where it is then."""

    requires_lease = True
    resource = RESOURCE

    def __init__(self, label: str, arm: KeptArm) -> None:
        super().__init__(label)
        self._arm = arm

    def answer(self, question: Freedrive, request: Request) -> FreedriveAnswer:
        weight = f"{self._arm.params.weight_kg:g} kg"
        if question.motors_off and not question.somebody_holds_the_arm:
            raise Refused("arm.not_held", f"without its motors the arm falls: {weight}")
        self._arm.power(on=not question.motors_off)
        off = f"the motors are off: the arm falls unless somebody holds its {weight}"
        message = off if question.motors_off else "the motors hold the arm where it is"
        return FreedriveAnswer(motors_off=question.motors_off, message=message)


class ArmFreedriveConfigurer(ArmConfigurer[PartParams]):
    """Switches the motors of an arm off, to move it by hand, and on again."""

    connector_type = "arm-freedrive"

    def configure(self) -> ArmFreedrive:
        return ArmFreedrive(self.label, self.arm)
