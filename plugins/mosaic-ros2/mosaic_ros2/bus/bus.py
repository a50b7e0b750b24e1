"""Declares the bus: what the connectors need of a middleware. DDS and Zenoh implement it.

Messages are CDR bytes with their header of four bytes. Every method may be called from any thread but the event
loop's: opening and closing may block for a moment.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Literal, Protocol, TypeAlias

from mosaic_core import DeviceGone
from mosaic_ros2.bus.qos import QosProfile

EndpointRole: TypeAlias = Literal["publisher", "subscription", "server", "client"]


class BusError(DeviceGone):
    """The middleware is not there, or refuses something: the connector tries again."""


class NotTaken(BusError):
    """One message found no room, because subscriptions are too slow. The publication goes on as it is."""


@dataclass(frozen=True, slots=True)
class Arrived:
    """A message that came. ``sent_at_ns``: its publisher's wall clock, since 1970; 0: not known."""

    data: bytes
    sent_at_ns: int = 0


@dataclass(frozen=True, slots=True)
class HeardEndpoint:
    """Somebody else's publisher, subscription, server or client of ``name``. ``type`` as ROS names it, of a service
    without ``_Request``. ``is_foreign_service``: a server whose requests are built in a way that can't be spoken here.
    """

    name: str
    type: str
    role: EndpointRole
    qos: QosProfile = field(default_factory=QosProfile)
    is_foreign_service: bool = False


class Subscription(Protocol):
    """Receives the messages of one topic, the newest few of them."""

    def take(self, timeout_s: float) -> Sequence[Arrived]:
        """What waits, or comes within ``timeout_s``; the oldest first."""

    @property
    def publishers(self) -> int:
        """How many publishers it hears now."""

    def close(self) -> None:
        """Ask for it no more."""


class Publication(Protocol):
    """Sends messages on one topic."""

    def write(self, data: bytes) -> None:
        """Send one message. Blocks for some milliseconds at most. Raises :class:`NotTaken`, and another
        :class:`BusError` where the publication is lost and has to be opened again."""

    @property
    def readers(self) -> int:
        """How many subscriptions hear it now. Raises :class:`BusError` where the publication is lost."""

    def close(self) -> None:
        """Publish no more."""


class ServiceCaller(Protocol):
    """Calls one service, any number of calls at a time."""

    def call(self, data: bytes, is_over: Callable[[], bool]) -> bytes | None:
        """The reply to this request; ``None`` once ``is_over`` says so, which is asked several times a second. Raises
        :class:`BusError` where no server is, or one that can't be spoken to."""

    def close(self) -> None:
        """Call it no more."""


class Bus(Protocol):
    """Reaches the nodes of one ROS domain."""

    where: str
    """The domain and the network, for people: ``DDS, domain 0``."""

    def endpoints(self) -> Sequence[HeardEndpoint]:
        """Everybody else's endpoints that are heard now."""

    def subscribe(self, topic: str, type_name: str, qos: QosProfile) -> Subscription:
        """Raises :class:`BusError`, and :class:`~mosaic_ros2.definitions.definition.DefinitionError`."""

    def publish(self, topic: str, type_name: str, qos: QosProfile) -> Publication:
        """Raises as :meth:`subscribe` does."""

    def caller(self, service: str, type_name: str) -> ServiceCaller:
        """Raises as :meth:`subscribe` does. ``type_name``: without ``_Request``."""

    def learn_type(self, topic: str) -> str:
        """The type of this topic, taken from a publisher that tells its definition; empty: none does."""

    def close(self) -> None:
        """Leave the domain."""
