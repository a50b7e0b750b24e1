"""Throughput and round trip of a connection that an operator has, over its very path.

A robot with a ``connection-check`` echoes, so that both directions are measured. To any other one a channel is opened
that it leaves unread: then SCTP's acknowledgements tell of the way to it.
"""

from __future__ import annotations

import asyncio
import secrets
import time
from typing import Protocol

from mosaic_core.doctor.peer_checks import Speed
from mosaic_core.machines.diagnosis.path_trial import PIECE_BYTES, PathTrial
from mosaic_core.operator import ReceivableStore, RobotConnection, SendableStore
from mosaic_core.runtime.transport.transport import Channel
from mosaic_core.words.data_type import Direction, MosaicDataType
from mosaic_core.words.errors import MosaicError
from mosaic_core.words.original_types import CONNECTION_CHECK

OPEN_TIMEOUT_S = 4.0
"""For channels and first answers: some round trips, by way of a satellite too."""
PINGS, PINGING_S = 3, 0.3
TICK_S = 0.005
"""How often what has arrived is looked at: at 100 Mbit/s that is 60 kB, a quarter of what may be under way."""
UNREAD_LABEL = "_path_trial"


class _Way(Protocol):
    """A way on which pieces of data go, and how many bytes of them have arrived."""

    name: str

    @property
    def round_trip_ms(self) -> float | None:
        """The shortest, known once the trial is over."""

    async def open(self) -> None: ...
    def send(self) -> bool: ...
    def arrived_bytes(self, sent_bytes: int) -> int: ...
    def close(self) -> None: ...


async def measured_path(connection: RobotConnection) -> Speed:
    """Takes two seconds, and a moment to open a channel. Raises :class:`MosaicError` or
    :class:`TimeoutError` where nothing comes through."""
    way = _way_of(connection)
    try:
        async with asyncio.timeout(OPEN_TIMEOUT_S):
            await way.open()
        trial = PathTrial(time.monotonic())
        while not trial.is_over(time.monotonic()):
            while trial.has_room(time.monotonic()) and way.send():
                trial.sent_bytes += PIECE_BYTES
            await asyncio.sleep(TICK_S)
            trial.arrived(way.arrived_bytes(trial.sent_bytes), time.monotonic())
        if trial.arrived_bytes == 0 or way.round_trip_ms is None:
            raise TimeoutError
        least = trial.is_least(way.round_trip_ms / 1000)
        return Speed(trial.throughput_bps(), way.round_trip_ms, least, way.name)
    finally:
        way.close()


def _way_of(connection: RobotConnection) -> _Way:
    entries = connection.catalogue.entries if connection.catalogue else ()
    for entry in entries:
        if entry.type == CONNECTION_CHECK:
            labels = {channel.data_type.direction: channel.label for channel in entry.channels}
            return _Echo(connection, labels[Direction.TO_ROBOT], labels[Direction.TO_OPERATOR])
    return _Unread(connection)


class _Echo:
    """Measures a path there and back, over both channels of a ``connection-check``."""

    name = "there and back"

    def __init__(self, connection: RobotConnection, there: str, back: str) -> None:
        self.round_trip_ms: float | None = None
        self._there: SendableStore = connection.sendable(there, MosaicDataType.STRING_U2R)
        self._back: ReceivableStore = connection.receivable(back)
        self._token = secrets.token_hex(8)
        """Others may use the connector as well."""
        self._piece = self._token.ljust(PIECE_BYTES, ".")
        self._arrived_bytes = 0
        self._pinged = asyncio.Event()
        self._unsubscribe = self._back.subscribe(self._came)

    async def open(self) -> None:
        await self._back.wait_open(OPEN_TIMEOUT_S)
        await self._there.wait_open(OPEN_TIMEOUT_S)
        began_s, pings_ms = time.monotonic(), [await self._ping_ms()]
        while len(pings_ms) < PINGS and time.monotonic() - began_s < PINGING_S:
            pings_ms.append(await self._ping_ms())
        self.round_trip_ms = min(pings_ms)

    def send(self) -> bool:
        return self._there.send_data(self._piece)

    def arrived_bytes(self, sent_bytes: int) -> int:
        return self._arrived_bytes

    def close(self) -> None:
        self._unsubscribe()

    async def _ping_ms(self) -> float:
        self._pinged.clear()
        began_s = time.monotonic()
        self._there.send_data(self._token)
        await self._pinged.wait()
        return (time.monotonic() - began_s) * 1000

    def _came(self, data: bytes) -> None:
        if not data.startswith(self._token.encode()):
            return
        if len(data) == PIECE_BYTES:
            self._arrived_bytes += len(data)
        else:
            self._pinged.set()


class _Unread:
    """A channel of no connector."""

    name = "operator to robot"

    def __init__(self, connection: RobotConnection) -> None:
        self._connection = connection
        self._channel: Channel = connection.unread_channel(UNREAD_LABEL)
        self._opened = asyncio.Event()
        self._opening_ms: float | None = None
        self._channel.on_open = self._opened.set

    @property
    def round_trip_ms(self) -> float | None:
        """Of the control channel's pings, or of opening the channel, which takes one as well."""
        best_us = self._connection.round_trip_us_best
        known_ms = [self._opening_ms] if best_us is None else [self._opening_ms, best_us / 1000]
        return min((one for one in known_ms if one is not None), default=None)

    async def open(self) -> None:
        began_s = time.monotonic()
        if not self._channel.is_open:
            await self._opened.wait()
            self._opening_ms = (time.monotonic() - began_s) * 1000

    def send(self) -> bool:
        try:
            self._channel.send(bytes(PIECE_BYTES))
        except MosaicError:
            return False  # the connection is over; the trial ends by its time
        return True

    def arrived_bytes(self, sent_bytes: int) -> int:
        """What was acknowledged; other channels' few bytes may be among those that were not."""
        return max(0, sent_bytes - self._channel.buffered_bytes - self._channel.under_way_bytes)

    def close(self) -> None:
        self._channel.close()
