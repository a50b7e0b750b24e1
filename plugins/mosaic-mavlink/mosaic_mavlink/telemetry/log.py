"""The ``mavlink-log`` connector: the texts of a vehicle."""

from __future__ import annotations

from collections.abc import Iterator

from mosaic_core.contract.handler import DataChannelSendable
from mosaic_core.messages import Log
from mosaic_mavlink.link.contact import VehicleContact
from mosaic_mavlink.link.vehicle_configurer import VehicleConfigurer
from mosaic_mavlink.params import VehicleParams

PERIOD_S = 0.1


class MavlinkLog(DataChannelSendable[Log]):
    """Sends each text once, in order; what the link's memory has let go is counted as lost."""

    def __init__(self, label: str, contact: VehicleContact) -> None:
        super().__init__(label)
        self._contact = contact
        self._told = 0
        """Over restarts: a vehicle that comes back does not say everything again."""

    def messages(self) -> Iterator[Log]:
        """Raises :class:`DeviceGone` while the vehicle is away."""
        for _ in self.every(PERIOD_S):
            self._contact.is_there()
            for one in self._contact.vehicle.texts.since(self._told):
                if one.number > self._told + 1:
                    self.count_loss("lost", one.number - self._told - 1)
                self._told = one.number
                yield Log(level=one.level, message=one.text, name="vehicle", timestamp=one.stamp_us)


class MavlinkLogConfigurer(VehicleConfigurer[VehicleParams]):
    """What an ArduPilot or PX4 vehicle says in words."""

    connector_type = "mavlink-log"

    def configure(self) -> MavlinkLog:
        return MavlinkLog(self.label, self.contact)
