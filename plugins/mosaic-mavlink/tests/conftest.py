"""A vehicle in the test's own time: real MAVLink bytes between a link and autopilots, without sockets or threads."""

from __future__ import annotations

from collections import deque
from typing import Any

import pytest

from mosaic_core.contract.devices.shared import Shared
from mosaic_mavlink.fake.autopilot import FakeAutopilot
from mosaic_mavlink.link.address import LinkAddress, Source
from mosaic_mavlink.link.codec import MavlinkCodec
from mosaic_mavlink.link.contact import VehicleContact
from mosaic_mavlink.link.link import MavlinkLink
from mosaic_mavlink.params import VehicleParams

STEP_S = 0.05
URL = "udpin:127.0.0.1:14550"


class Air:
    """The port of a link, and the vehicles behind it by their system ids. ``now_s`` moves with :meth:`pass_time`."""

    def __init__(self) -> None:
        self.now_s = 100.0
        self.vehicles: dict[int, FakeAutopilot] = {}
        self.sources: dict[int, Source] = {}
        self.silent: set[int] = set()
        self.heard: list[Any] = []
        """What the vehicles were sent."""
        self.broken: OSError | None = None
        self.drops: Any = lambda name: False
        """Which messages of a vehicle get lost, by name in small letters."""
        self.waiting: deque[tuple[bytes, Source]] = deque()
        self._codecs: dict[int, MavlinkCodec] = {}
        self._reader = MavlinkCodec("ardupilotmega", 1, 1)
        self.link: MavlinkLink | None = None

    def add(self, kind: str = "copter", system_id: int = 1) -> FakeAutopilot:
        self.vehicles[system_id] = FakeAutopilot(kind)
        self._codecs[system_id] = MavlinkCodec("ardupilotmega", system_id, 1)
        self.sources[system_id] = ("10.0.0.1", 14550)
        return self.vehicles[system_id]

    def contact(self, **params: Any) -> VehicleContact:
        """The first call opens the link."""
        wanted = VehicleParams.model_validate({"url": URL, **params})
        if self.link is None:
            self.link = MavlinkLink(wanted, opens=self._open, clock=lambda: self.now_s)
            self.link.open()
        return VehicleContact(self.link, self.link.vehicle(wanted))

    def shared(self) -> Shared:
        """What the connectors of a robot share, with this link in it."""
        link, shared = self.contact().link, Shared()
        shared.get(f"mosaic-mavlink:{URL}", lambda: link)
        return shared

    def _open(self, address: LinkAddress, baud: int) -> Air:
        return self

    def say(self, name: str, system_id: int = 1, **fields: Any) -> None:
        """A vehicle says this, whatever its autopilot thinks."""
        self.waiting.append((self._codecs[system_id].packed(name, fields), self.sources[system_id]))

    def read(self, timeout_s: float) -> tuple[bytes, Source]:
        if self.broken is not None:
            raise self.broken
        for system_id, autopilot in self.vehicles.items():
            for name, fields in autopilot.tick(self.now_s):
                self._pack(system_id, name, fields)
        return self.waiting.popleft() if self.waiting else (b"", None)

    def _pack(self, system_id: int, name: str, fields: dict[str, Any]) -> None:
        if system_id not in self.silent and not self.drops(name):
            self.waiting.append((self._codecs[system_id].packed(name, fields), self.sources[system_id]))

    def write(self, data: bytes, to: Source) -> None:
        if self.broken is not None:
            raise self.broken
        for message in self._reader.messages(data, None, self.now_s):
            self.heard.append(message)
            target = getattr(message, "target_system", getattr(message, "target", 0))
            for system_id, autopilot in self.vehicles.items():
                if system_id not in self.silent and target in (0, system_id):
                    answers = list(autopilot.hear(message, self.now_s))
                    for name, fields in answers:
                        self._pack(system_id, name, {**_to_us(name), **fields})

    def close(self) -> None:
        """Nothing is open."""

    def pass_time(self, seconds: float) -> None:
        """Let the link step, and everything that is on its way arrive."""
        assert self.link is not None
        for _ in range(max(1, round(seconds / STEP_S))):
            self.now_s += STEP_S
            self.link.step()
            while self.waiting:
                self.link.step()

    def sent(self, kind: str) -> list[Any]:
        """The messages of a kind that the vehicles were sent, but for rates."""
        return [
            one for one in self.heard if one.get_type() == kind and not (kind == "COMMAND_LONG" and one.command == 511)
        ]


def _to_us(name: str) -> dict[str, int]:
    is_named = name.startswith("mission_") or name == "command_ack"
    return {"target_system": 255, "target_component": 190} if is_named else {}


@pytest.fixture
def air() -> Air:
    """Empty: add vehicles."""
    return Air()


@pytest.fixture
def copter(air: Air) -> FakeAutopilot:
    """A copter that was heard; it is disarmed, in LOITER."""
    autopilot = air.add()
    air.contact()
    air.pass_time(0.2)
    return autopilot
