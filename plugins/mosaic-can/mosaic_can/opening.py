"""Opens a bus with python-can, or one that is made up."""

from __future__ import annotations

from typing import Any, Protocol

import can

from mosaic_can.databases import CanDatabase
from mosaic_can.fake_bus import FakeCanBus
from mosaic_can.params import FAKE, CanBusParams

SEND_TIMEOUT_S = 0.05
"""A frame that finds no room for so long is refused: nobody takes frames off this bus."""


class OpenBus(Protocol):
    """What of python-can's bus is used. All may raise :class:`can.CanError` and :class:`OSError`."""

    def recv(self, timeout: float | None = None) -> can.Message | None: ...

    def send(self, msg: can.Message, timeout: float | None = None) -> None: ...

    def shutdown(self) -> None: ...

    @property
    def state(self) -> can.BusState: ...


def opened_bus(params: CanBusParams, database: CanDatabase) -> OpenBus:
    """An open bus. Raises :class:`can.CanError`, :class:`OSError` or :class:`ValueError`."""
    if params.interface == FAKE:
        return FakeCanBus(database)
    options: dict[str, Any] = dict(params.options)
    if params.bitrate is not None:
        options["bitrate"] = params.bitrate
    if params.fd:
        options["fd"] = True
    return can.Bus(interface=params.interface, channel=params.channel, **options)
