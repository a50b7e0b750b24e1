"""A bus whose steps a test takes itself, on python-can's virtual interface, with another node on it."""

from __future__ import annotations

import itertools
from typing import Any

import can

from mosaic_can.databases import CanDatabase
from mosaic_can.kept_bus import KeptCanBus
from mosaic_can.params import CanBusParams
from mosaic_core.contract.devices.shared import Shared
from mosaic_core.testing import build, fake_host

_CHANNELS = itertools.count()
STATE_ID, BATTERY_ID, COMMAND_ID = 0x201, 0x202, 0x101


class PluggableBus:
    """The virtual bus, as long as its adapter is plugged in."""

    def __init__(self, within: can.BusABC, pluggable: CanOnSteps) -> None:
        self._within = within
        self._its = pluggable

    def recv(self, timeout: float | None = None) -> can.Message | None:
        self._its.check()
        return self._within.recv(timeout)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self._its.check()
        if self._its.is_full:
            raise can.CanOperationError("Transmit buffer full")
        self._within.send(msg)

    def shutdown(self) -> None:
        self._within.shutdown()

    @property
    def state(self) -> can.BusState:
        return self._its.state


class CanOnSteps:
    """``bus`` without a thread, and ``node``, another one on the same wires."""

    def __init__(self, dbc: str = "sample") -> None:
        channel = f"test-{next(_CHANNELS)}"
        self.params = CanBusParams(interface="virtual", channel=channel, dbc=(dbc,))
        self.node = can.Bus(interface="virtual", channel=channel)
        self.is_plugged_in = True
        self.is_full = False
        self.state = can.BusState.ACTIVE
        self.opened = 0
        self.bus = KeptCanBus(self.params, self._open)
        self.shared = Shared()
        self.shared.get(f"mosaic-can:virtual:{channel}", lambda: self.bus)

    def _open(self, params: CanBusParams, database: CanDatabase) -> PluggableBus:
        self.check()
        self.opened += 1
        return PluggableBus(can.Bus(interface=params.interface, channel=params.channel), self)

    def check(self) -> None:
        if not self.is_plugged_in:
            raise can.CanOperationError("Network is down", 100)

    def build(self, configurer: Any, safety: Any = None, **params: Any) -> Any:
        """A handler on this bus. ``losses`` of its host tell what it left out."""
        bus = self.params.model_dump()
        return build(configurer, params={"bus": bus, **params}, safety=safety, shared=self.shared)

    def says(self, *frames: tuple[int, bytes] | can.Message) -> None:
        """The other node sends these, and they arrive."""
        for one in frames:
            frame = one if isinstance(one, can.Message) else data_frame(*one)
            self.node.send(frame)
            assert self.bus.step(1.0)

    def heard(self) -> list[can.Message]:
        """What the other node has heard so far."""
        found = []
        while (frame := self.node.recv(0)) is not None:
            found.append(frame)
        return found


def data_frame(frame_id: int, data: bytes) -> can.Message:
    """One with an id of 11 bits."""
    return can.Message(arbitration_id=frame_id, data=data, is_extended_id=False)


def error_frame(classes: int) -> can.Message:
    """As SocketCAN tells what went wrong."""
    return can.Message(arbitration_id=classes, is_error_frame=True, data=bytes(8))


def losses(handler: Any) -> dict[str, int]:
    return {str(reason): count for reason, count in fake_host(handler).losses.items()}
