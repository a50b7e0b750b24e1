"""The base of configurers whose connectors are of an arm."""

from __future__ import annotations

from typing import Any, ClassVar, TypeVar

from mosaic_arm.params import PartParams
from mosaic_arm.shared_arm import KeptArm, shared_arm
from mosaic_core import DataChannelConfigurer

P = TypeVar("P", bound=PartParams)


class ArmConfigurer(DataChannelConfigurer[P]):
    """Makes connectors of the arm that the params name."""

    example: ClassVar[dict[str, Any] | None] = {"arm": {"port": "/dev/ttyACM0"}}
    trial: ClassVar[dict[str, Any] | None] = {"arm": {"bus": "fake", "port": "trial"}}

    @property
    def arm(self) -> KeptArm:
        """The same for all who ask."""
        return shared_arm(self.params.arm, self.shared)
