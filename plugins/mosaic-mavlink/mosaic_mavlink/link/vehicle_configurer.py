"""The base of configurers whose connectors speak with a vehicle."""

from __future__ import annotations

from typing import Any, ClassVar, TypeVar

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_mavlink.link.contact import VehicleContact
from mosaic_mavlink.params import VehicleParams

V = TypeVar("V", bound=VehicleParams)
EXAMPLE: dict[str, Any] = {"url": "udpin:127.0.0.1:14550"}


class VehicleConfigurer(DataChannelConfigurer[V]):
    """Makes connectors of the vehicle that the params name."""

    example: ClassVar[dict[str, Any] | None] = EXAMPLE
    trial: ClassVar[dict[str, Any] | None] = {"url": "fake:"}

    @property
    def contact(self) -> VehicleContact:
        """The robot's contact with it."""
        return VehicleContact.of(self.shared, self.params)
