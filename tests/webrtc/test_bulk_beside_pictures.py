"""What gives way is sent no faster than pictures of the same operator leave room for."""

from __future__ import annotations

import asyncio
import time
from typing import Any

import pytest

from mosaic_core.machines.congestion.background_rate import START_BPS
from mosaic_core.machines.congestion.path_watch import PathSeen
from mosaic_core.runtime.transport.transport import Channel

pytestmark = pytest.mark.webrtc
WAIT_S = 30.0
MESSAGES, MESSAGE = 4, bytes(12_000)


async def transfer_s(pair: Any, *, has_pictures: bool) -> float:
    """How long some messages take."""
    async with pair() as peers:
        arrived: asyncio.Queue[bytes | str] = asyncio.Queue()
        mine = peers.operator.create_channel("bulk")
        mine.on_message = arrived.put_nowait
        await peers.join()
        bulk: Channel = await asyncio.wait_for(peers.robot_side.channels.get(), WAIT_S)
        began_s = time.monotonic()
        if has_pictures:
            peers.robot_side.congestion.background.reported(PathSeen(0.0, 0.0, began_s, 5, 0), 0.0, began_s)
        bulk.give_way(True)
        for _ in range(MESSAGES):
            bulk.send(MESSAGE)
        async with asyncio.timeout(WAIT_S):
            for _ in range(MESSAGES):
                await arrived.get()
        return time.monotonic() - began_s


async def test_beside_pictures_it_keeps_to_its_rate(pair: Any) -> None:
    least_s = MESSAGES * len(MESSAGE) * 8 / START_BPS
    assert await transfer_s(pair, has_pictures=True) > 0.9 * least_s


@pytest.mark.parametrize("gives_way", [False, True])
async def test_ordinary_data_counts_in_the_budget_and_what_gives_way_does_not(pair: Any, gives_way: bool) -> None:
    async with pair() as peers:
        counted: list[int] = []
        peers.robot_side.congestion.data_left = counted.append
        arrived: asyncio.Queue[bytes | str] = asyncio.Queue()
        mine = peers.operator.create_channel("data")
        mine.on_message = arrived.put_nowait
        await peers.join()
        channel: Channel = await asyncio.wait_for(peers.robot_side.channels.get(), WAIT_S)
        channel.give_way(gives_way)
        for _ in range(MESSAGES):
            channel.send(MESSAGE)
        async with asyncio.timeout(WAIT_S):
            for _ in range(MESSAGES):
                await arrived.get()
        assert (sum(counted) >= MESSAGES * len(MESSAGE)) is not gives_way
