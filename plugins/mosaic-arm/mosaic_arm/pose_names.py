"""The ``arm-pose-names`` connector: which poses ``arm-poses`` knows. Looking moves nothing, so it needs no lease."""

from __future__ import annotations

from collections.abc import Iterator

from pydantic import Field

from mosaic_arm.arm_configurer import ArmConfigurer
from mosaic_arm.params import PartParams
from mosaic_arm.shared_arm import KeptArm
from mosaic_core import DataChannelSendable, Message

PERIOD_S = 0.5
"""How soon a pose that was saved is listed."""


class PoseNames(Message):
    """The poses that an arm can be told to go to."""

    names: list[str] = Field(description="Sorted.")


class ArmPoseNames(DataChannelSendable[PoseNames]):
    """Sends the names of all poses of an arm, once and whenever they change; whoever comes later gets them too."""

    def __init__(self, label: str, arm: KeptArm) -> None:
        super().__init__(label)
        self._arm = arm

    def messages(self) -> Iterator[PoseNames]:
        told: list[str] | None = None
        for _ in self.every(PERIOD_S):
            names = sorted({name for book in tuple(self._arm.pose_books.values()) for name in book.names()})
            if names != told:
                told = names
                yield PoseNames(names=names)


class ArmPoseNamesConfigurer(ArmConfigurer[PartParams]):
    """Tells which poses an arm has, to everybody."""

    connector_type = "arm-pose-names"

    def configure(self) -> ArmPoseNames:
        return ArmPoseNames(self.label, self.arm)
