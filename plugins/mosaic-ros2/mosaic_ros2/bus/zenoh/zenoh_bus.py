"""The bus over Zenoh: one session for all connectors of a robot that are in the same domain."""

from __future__ import annotations

import threading
from collections.abc import Callable

from mosaic_ros2.bus.bus import HeardEndpoint
from mosaic_ros2.bus.qos import QosProfile
from mosaic_ros2.bus.zenoh.zenoh_service import ZenohServiceCaller
from mosaic_ros2.bus.zenoh.zenoh_session import ROUTER, ZenohSession
from mosaic_ros2.bus.zenoh.zenoh_topics import ZenohPublication, ZenohSubscription
from mosaic_ros2.definitions.type_book import TypeBook
from mosaic_ros2.definitions.type_hash import type_hash


class ZenohBus:
    """Joins a domain by way of a router. The session is opened when it is needed first, and again after a failure."""

    def __init__(self, domain: int, book: TypeBook, routers: tuple[str, ...] = ()) -> None:
        self.domain = domain
        self.where = f"Zenoh, domain {domain}, router {', '.join(routers) or ROUTER}"
        self._book = book
        self._routers = routers
        self._lock = threading.Lock()
        self._session: ZenohSession | None = None
        self._hash: Callable[[str], str] = lambda name: type_hash(book, name)

    def _joined(self) -> ZenohSession:
        with self._lock:
            if self._session is None:
                self._session = ZenohSession(self.domain, self._routers)
            return self._session

    def endpoints(self) -> list[HeardEndpoint]:
        return sorted((one.endpoint for one in self._joined().tokens()), key=lambda one: (one.name, one.role))

    def subscribe(self, topic: str, type_name: str, qos: QosProfile) -> ZenohSubscription:
        return ZenohSubscription(self._joined(), HeardEndpoint(topic, type_name, "subscription", qos), self._hash)

    def publish(self, topic: str, type_name: str, qos: QosProfile) -> ZenohPublication:
        return ZenohPublication(self._joined(), HeardEndpoint(topic, type_name, "publisher", qos), self._hash)

    def caller(self, service: str, type_name: str) -> ZenohServiceCaller:
        return ZenohServiceCaller(self._joined(), HeardEndpoint(service, type_name, "client"))

    def learn_type(self, topic: str) -> str:
        """rmw_zenoh tells a type's name and hash, not its fields."""
        return ""

    def close(self) -> None:
        with self._lock:
            if self._session is not None:
                self._session.close()
                self._session = None
