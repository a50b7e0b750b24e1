"""What a peer sends in bulk leaves the queue of a slow router short, so that a command beside it is not late."""

from __future__ import annotations

import asyncio
import statistics
import time
from typing import Any

import pytest

from mosaic_core.adapters.peers.aiortc_answerer import AiortcAnswerer
from mosaic_core.laboratory.impaired_answerer import impaired
from mosaic_core.laboratory.impaired_path import ImpairedPath
from mosaic_core.machines.delivery.send_scheduler import HIGH_WATER_BYTES
from mosaic_core.machines.laboratory.impaired_link import LinkProfile
from mosaic_core.runtime.transport.transport import Channel

pytestmark = pytest.mark.webrtc
WAIT_S = 30.0
ROUTER = LinkProfile("home router", delay_ms=10, rate_mbps=4, queue_ms=600)
BLOCK = bytes(8 * 1024)


def test_a_command_beside_bulk_is_not_as_late_as_the_router_could_make_it(pair: Any) -> None:
    async def scenario(path: ImpairedPath) -> tuple[list[float], int]:
        async with pair() as peers:
            peers.robot = impaired(AiortcAnswerer, path)(peers.robot_side, ())
            peers.operator_side.other = peers.robot
            bulk = peers.operator.create_channel("bulk")
            command = peers.operator.create_channel("command", ordered=False, max_retransmits=0)
            answers: asyncio.Queue[bytes | str] = asyncio.Queue()
            command.on_message = answers.put_nowait
            opened = asyncio.Event(), asyncio.Event()
            bulk.on_open, command.on_open = opened[0].set, opened[1].set
            await peers.join()
            await asyncio.wait_for(asyncio.gather(*(event.wait() for event in opened)), WAIT_S)
            robots: dict[str, Channel] = {}
            while len(robots) < 2:
                channel = await asyncio.wait_for(peers.robot_side.channels.get(), WAIT_S)
                robots[channel.label] = channel
            robots["command"].on_message = robots["command"].send
            came = [0]
            robots["bulk"].on_message = lambda data: came.append(came.pop() + len(data))
            flooding = asyncio.create_task(flood(bulk))
            try:
                await trips(command, answers, 15)  # until the queue has found its length
                before = came[0]
                return await trips(command, answers, 25), came[0] - before
            finally:
                flooding.cancel()

    with ImpairedPath(ROUTER) as path:
        start_s = time.monotonic()
        round_trips, arrived_bytes = asyncio.run(scenario(path))
    assert statistics.median(round_trips) < 0.3, "the router's own queue would make it more than 0.6 s"
    assert arrived_bytes * 8 > 0.3 * ROUTER.rate_mbps * 1e6 * sum(round_trips), "an idle link has no queue either"
    assert time.monotonic() - start_s < 60


async def flood(channel: Channel) -> None:
    while True:
        while channel.buffered_bytes < HIGH_WATER_BYTES // 2:
            channel.send(BLOCK)
        await asyncio.sleep(0.005)


async def trips(channel: Channel, answers: asyncio.Queue[bytes | str], count: int) -> list[float]:
    found = []
    for _ in range(count):
        start_s = time.monotonic()
        channel.send("are you there?")
        await asyncio.wait_for(answers.get(), WAIT_S)
        found.append(time.monotonic() - start_s)
    return found
