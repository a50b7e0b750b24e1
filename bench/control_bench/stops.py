"""Our own side: commands, stops by silence and stops that were asked for, measured where the drive is told."""

from __future__ import annotations

import asyncio
import random
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass

from control_bench.site import COMMAND_PERIOD_S, DRIVES, TIMEOUT_S, Record
from mosaic_core.operator import MosaicOperator, RobotConnection
from mosaic_core.operator.delivery.data_port import MessageInfo

TWIST = {"linear": {"x": 0.5}, "angular": {"z": 0.1}}
STANDING = {"linear": {"x": 0.0}, "angular": {"z": 0.0}}
CLEAR_PERIOD_S = 0.07
"""Slower than the rate of requests that the robot allows one operator."""


@dataclass
class Commands:
    """The way of a command, through every gate to the drive, which one after the other tells another speed."""

    connection: RobotConnection
    record: Record

    async def took_ms(self, count: int) -> tuple[float, ...]:
        pad = self.connection.sendable("drive_0")
        await pad.wait_open()
        sent_s: dict[float, float] = {}
        for number in range(count):
            speed = round(0.1 + number / 10_000, 4)
            sent_s[speed] = time.monotonic()
            pad.send_json({"linear": {"x": speed}, "angular": {"z": 0.1}})
            await asyncio.sleep(COMMAND_PERIOD_S)
        told_s = await self.record.all_told("0", sent_s)
        return tuple(1000 * (at_s - since_s) for at_s, since_s in zip(told_s, sent_s.values(), strict=True))


@dataclass
class Silence:
    """Commands, then nothing: how much later than ``timeout_s`` after the last one is the drive told to stand?"""

    connection: RobotConnection
    record: Record

    async def late_ms(self, stops: int) -> tuple[float, ...]:
        """Of ``stops`` stops, several drives at a time."""
        chance = random.Random(3)
        share = -(-stops // DRIVES)
        rounds = (self._one_drive(str(number), share, chance) for number in range(DRIVES))
        found = await asyncio.gather(*rounds)
        return tuple(value for values in found for value in values)

    async def _one_drive(self, name: str, stops: int, chance: random.Random) -> list[float]:
        pad = self.connection.sendable(f"drive_{name}")
        await pad.wait_open()
        late_ms = []
        for _ in range(stops):
            await asyncio.sleep(chance.uniform(0, 0.05))
            start_s = time.monotonic()
            await self.record.moves(name, start_s, lambda: pad.send_json(TWIST))
            stopped_s = await self.record.stopped_s(name, start_s)
            late_ms.append(1000 * (stopped_s - self.record.last_moved_s(name, stopped_s) - TIMEOUT_S))
        return late_ms


@dataclass
class AskedFor:
    """Driving, then stop: how long until the drive is told to stand?"""

    connection: RobotConnection
    record: Record

    async def took_ms(self, stops: int) -> tuple[float, ...]:
        chance = random.Random(4)
        control, pad = self.connection.control, self.connection.sendable("drive_0")
        took = []
        for _ in range(stops):
            async with driving(self.connection, self.record):
                await asyncio.sleep(chance.uniform(0, COMMAND_PERIOD_S))
                said_s = time.monotonic()
                await control.stop("bench")
                took.append(1000 * (await self.record.stopped_s("0", said_s) - said_s))
            await asyncio.sleep(CLEAR_PERIOD_S)
            await control.clear_stop()
            pad.send_json(STANDING)  # who sent on through the stop lets go first
            await asyncio.sleep(COMMAND_PERIOD_S)  # or the next command would take its place
        return tuple(took)


@asynccontextmanager
async def driving(connection: RobotConnection, record: Record) -> AsyncIterator[None]:
    """Drive 0 moves."""
    pad = connection.sendable("drive_0")
    await pad.wait_open()
    await record.moves("0", time.monotonic(), lambda: pad.send_json(TWIST))

    async def drive() -> None:
        while True:
            pad.send_json(TWIST)
            await asyncio.sleep(COMMAND_PERIOD_S)

    task = asyncio.create_task(drive())
    try:
        yield
    finally:
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task


@dataclass
class Taken:
    """Bulk that arrived."""

    size_bytes: int = 0
    since_s: float = 0.0

    @property
    def rate_mbyteps(self) -> float:
        return self.size_bytes / (time.monotonic() - self.since_s) / 1e6


@asynccontextmanager
async def bulk_beside(operator: MosaicOperator, connection: RobotConnection) -> AsyncIterator[Taken]:
    """The robot sends bulk to this operator, on the same connection."""
    taken = Taken(since_s=time.monotonic())

    def take(data: bytes, _info: MessageInfo) -> None:
        taken.size_bytes += len(data)

    store = connection.receivable("bulk")
    end = store.subscribe(take)
    try:
        await store.wait_open()
        await store.next_message()
        yield taken
    finally:
        end()
        operator.stores.release_store(store.robot_connector)


async def half_round_trip_ms(connection: RobotConnection) -> float:
    """The shortest of the last ten seconds; the first pings take a moment."""
    for _ in range(100):
        if connection.round_trip_us_best is not None:
            return connection.round_trip_us_best / 2000
        await asyncio.sleep(0.1)
    raise SystemExit("the robot answered no ping")
