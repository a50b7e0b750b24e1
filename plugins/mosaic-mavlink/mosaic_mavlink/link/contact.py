"""Joins a vehicle with its link: what connectors hold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from mosaic_core.contract.devices.shared import Shared
from mosaic_core.contract.handler import Refused
from mosaic_core.words.errors import DeviceGone
from mosaic_mavlink.link.link import MavlinkLink
from mosaic_mavlink.link.outgoing import OutgoingMessage
from mosaic_mavlink.link.vehicle import Vehicle, VehicleFacts
from mosaic_mavlink.params import VehicleParams


@dataclass(frozen=True, slots=True)
class VehicleContact:
    """One vehicle and the link over which it is reached. Every method may be called from any thread."""

    link: MavlinkLink
    vehicle: Vehicle

    @classmethod
    def of(cls, shared: Shared, params: VehicleParams) -> VehicleContact:
        """The robot's contact with the vehicle that ``params`` mean."""
        link = MavlinkLink.of(shared, params)
        return cls(link, link.vehicle(params))

    def now_s(self) -> float:
        """Seconds of the link's clock."""
        return self.link.now_s()

    def is_there(self) -> bool:
        """Whether its heart beats; ``False`` while it may still be heard. Raises :class:`DeviceGone`."""
        return self.link.require(self.vehicle)

    def facts(self) -> VehicleFacts:
        """What it last said of itself. Raises :class:`Refused` (``plugin.no_device``) while it is away."""
        try:
            is_there = self.link.require(self.vehicle)
        except DeviceGone as error:
            raise Refused("plugin.no_device", str(error)) from error
        if not is_there or self.vehicle.facts is None:
            raise Refused("plugin.no_device", "the vehicle has not been heard yet")
        return self.vehicle.facts

    def send(self, message: OutgoingMessage) -> bool:
        """Send to it now; whether the link took it."""
        return self.link.send(self.vehicle, message)

    def is_for_us(self, message: Any) -> bool:
        """Whether it is an answer to us, or to all: other ground stations ask too."""
        return getattr(message, "target_system", 0) in (0, self.link.own_system_id)
