"""Shares one bus among the connectors of a robot, and makes it when it is used first."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Self

from mosaic_core.contract.devices.shared import Shared
from mosaic_ros2.bus.bus import Bus, BusError, ServiceCaller
from mosaic_ros2.definitions.type_book import TypeBook

NO_CYCLONE = (
    "`pip install cyclonedds` where there is a wheel (x86_64, Python up to 3.13), build it from source elsewhere, or "
    "use rmw_zenoh_cpp and `transport: zenoh`, whose wheels are for every machine"
)


@dataclass(frozen=True, slots=True)
class TypeChoice:
    """Where definitions come from: files and folders, and a distribution of ROS."""

    places: tuple[str, ...] = ()
    distribution: str = ""


@dataclass(frozen=True, slots=True)
class BusChoice:
    """Which bus is meant, and whose definitions it knows. Equal choices share one bus."""

    transport: str = "dds"
    domain: int = 0
    interface: str = ""
    peers: tuple[str, ...] = ()
    types: TypeChoice = TypeChoice()


class SharedBus:
    """Keeps a bus from when it is needed until the robot stops. Entering opens nothing."""

    def __init__(self, choice: BusChoice) -> None:
        self.book = TypeBook(choice.types.places, choice.types.distribution)
        self._choice = choice
        self._lock = threading.Lock()
        self._bus: Bus | None = None
        self._callers: dict[tuple[str, str], ServiceCaller] = {}

    @classmethod
    def of(cls, shared: Shared, choice: BusChoice) -> SharedBus:
        """The robot's one bus of this kind."""
        return shared.get(f"mosaic-ros2:{choice}", lambda: cls(choice))

    def joined(self) -> Bus:
        """The bus. Raises :class:`~mosaic_ros2.bus.bus.BusError` where its middleware is not installed."""
        with self._lock:
            if self._bus is None:
                self._bus = self._made()
            return self._bus

    def caller(self, service: str, type_name: str) -> ServiceCaller:
        """The client of this service, kept until the robot stops: its server finds it once. Raises as :meth:`joined`
        does, and :class:`~mosaic_ros2.definitions.definition.DefinitionError`."""
        bus = self.joined()
        with self._lock:
            if (service, type_name) not in self._callers:
                self._callers[service, type_name] = bus.caller(service, type_name)
            return self._callers[service, type_name]

    def _made(self) -> Bus:
        choice = self._choice
        if choice.transport == "zenoh":
            from mosaic_ros2.bus.zenoh.zenoh_bus import ZenohBus

            return ZenohBus(choice.domain, self.book, choice.peers)
        try:
            from mosaic_ros2.bus.dds.dds_bus import DdsBus
        except ImportError as error:
            raise BusError(f"Cyclone DDS is not there: {error}", NO_CYCLONE) from error
        return DdsBus(choice.domain, self.book, choice.interface, choice.peers)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        with self._lock:
            while self._callers:
                self._callers.popitem()[1].close()
            if self._bus is not None:
                self._bus.close()
                self._bus = None
