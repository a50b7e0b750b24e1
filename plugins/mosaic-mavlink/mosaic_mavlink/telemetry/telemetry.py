"""The base of what a vehicle tells: asks for messages at a rate, and sends what is new."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar, Generic, TypeVar

from mosaic_core.contract.handler import DataChannelSendable
from mosaic_core.contract.params import Message
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.delivery import DeliveryContract
from mosaic_mavlink.link.contact import VehicleContact
from mosaic_mavlink.link.vehicle import Heard

M = TypeVar("M", bound=Message)


class Telemetry(DataChannelSendable[M], Generic[M]):
    """Sends one kind of message of a vehicle. A subclass says what it asks for, and writes :meth:`reading`."""

    delivery: ClassVar[Delivery | DeliveryContract] = Delivery.LATEST
    asks_for: tuple[str, ...] = ()
    """The MAVLink messages that it needs, asked for at its rate."""

    def __init__(self, label: str, contact: VehicleContact, period_s: float) -> None:
        super().__init__(label)
        self.contact = contact
        self.period_s = period_s
        self._told: dict[str, int] = {}

    def messages(self) -> Iterator[M]:
        """Raises :class:`DeviceGone` while the vehicle is away."""
        self._told.clear()
        for kind in self.asks_for:
            self.contact.vehicle.rates.want(kind, self.period_s)
        for _ in self.every(self.period_s):
            reading = self.reading() if self.contact.is_there() else None
            if reading is not None:
                yield reading

    def reading(self) -> M | None:
        """What is new, or nothing."""
        raise NotImplementedError

    def latest(self, key: str) -> Heard | None:
        """The newest message of a kind, or ``KIND:id``, new or not."""
        return self.contact.vehicle.latest(key)

    def fresh(self, key: str) -> Heard | None:
        """The same if it was not sent before."""
        heard = self.latest(key)
        if heard is None or self._told.get(key) == heard.number:
            return None
        self._told[key] = heard.number
        return heard
