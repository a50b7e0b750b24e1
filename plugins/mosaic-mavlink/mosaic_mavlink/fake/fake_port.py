"""Runs a vehicle that is made up, and the port to it: real MAVLink bytes over real UDP on this machine."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable

from mosaic_mavlink.fake.autopilot import FakeAutopilot
from mosaic_mavlink.link.address import Source
from mosaic_mavlink.link.codec import MavlinkCodec
from mosaic_mavlink.link.ports import UdpPort

STEP_S = 0.02
JOIN_S = 1.0
LOOPBACK = "127.0.0.1"


class FakeVehicle:
    """Sends as one vehicle to a ground station's UDP port, on a thread of its own, until it is closed."""

    def __init__(
        self,
        autopilot: FakeAutopilot,
        to: tuple[str, int],
        *,
        system_id: int = 1,
        key: bytes | None = None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.autopilot = autopilot
        self.is_silent = False
        """Switched off, or out of reach: it neither hears nor speaks."""
        self._codec = MavlinkCodec("ardupilotmega", system_id, 1, key)
        self._port = UdpPort(None, to)
        self._clock = clock
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._run, name="fake-vehicle", daemon=True)
        self._thread.start()

    def write(self, data: bytes) -> None:
        """Send these very bytes."""
        self._port.write(data, None)

    def _run(self) -> None:
        try:
            while not self._ends.is_set():
                with contextlib.suppress(OSError):  # a ground station that closes is no reason to crash in the air
                    self._step()
        finally:
            self._port.close()

    def _step(self) -> None:
        data, source = self._port.read(STEP_S)
        now_s = self._clock()
        messages = list(self._codec.messages(data, source, now_s))
        if self.is_silent:
            return
        for message in messages:
            for name, fields in self.autopilot.hear(message, now_s):
                station = {"target_system": message.get_srcSystem(), "target_component": message.get_srcComponent()}
                self._port.write(self._codec.packed(name, {**_target(name, station), **fields}), None)
        for name, fields in self.autopilot.tick(now_s):
            self._port.write(self._codec.packed(name, fields), None)

    def close(self) -> None:
        """Switch it off for ever."""
        self._ends.set()
        self._thread.join(JOIN_S)


def _target(name: str, station: dict[str, int]) -> dict[str, int]:
    return station if name.startswith("mission_") or name == "command_ack" else {}


class FakePort:
    """The port of ``url: fake:``: a UDP socket, and a vehicle that sends to it."""

    def __init__(self, kind: str) -> None:
        self._port = UdpPort((LOOPBACK, 0), None)
        self.vehicle = FakeVehicle(FakeAutopilot(kind), self._port.address)

    def read(self, timeout_s: float) -> tuple[bytes, Source]:
        return self._port.read(timeout_s)

    def write(self, data: bytes, to: Source) -> None:
        self._port.write(data, to)

    def close(self) -> None:
        self.vehicle.close()
        self._port.close()
