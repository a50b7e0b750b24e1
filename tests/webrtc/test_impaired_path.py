"""The bad network in user space, with real peer connections through it."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from typing import Any

import pytest

from mosaic_core.adapters.peers.aiortc_answerer import AiortcAnswerer
from mosaic_core.laboratory.impaired_answerer import impaired
from mosaic_core.laboratory.impaired_path import ImpairedPath
from mosaic_core.machines.laboratory.impaired_link import LinkProfile
from mosaic_core.runtime.transport.transport import Channel

pytestmark = pytest.mark.webrtc
WAIT_S = 30.0


@pytest.fixture
def path() -> Iterator[ImpairedPath]:
    with ImpairedPath() as running:
        yield running


@asynccontextmanager
async def echo_through(pair: Any, path: ImpairedPath, *, reliable: bool) -> AsyncIterator[tuple[Channel, Any]]:
    """An operator's channel to a robot that sends everything back, and the queue of what came."""
    async with pair() as peers:
        peers.robot = impaired(AiortcAnswerer, path)(peers.robot_side, ())
        peers.operator_side.other = peers.robot
        options = {} if reliable else {"ordered": False, "max_retransmits": 0}
        channel = peers.operator.create_channel("echo", **options)
        is_open = asyncio.Event()
        channel.on_open = is_open.set
        came: asyncio.Queue[bytes | str] = asyncio.Queue()
        channel.on_message = came.put_nowait
        await peers.join()
        robots = await asyncio.wait_for(peers.robot_side.channels.get(), WAIT_S)
        robots.on_message = robots.send
        if not channel.is_open:
            await asyncio.wait_for(is_open.wait(), WAIT_S)
        yield channel, came


async def test_a_round_trip_takes_twice_the_delay(pair: Any, path: ImpairedPath) -> None:
    path.become(LinkProfile("slow", delay_ms=60))
    async with echo_through(pair, path, reliable=False) as (channel, came):
        start_s = time.monotonic()
        channel.send("there and back")
        await asyncio.wait_for(came.get(), WAIT_S)
        took_s = time.monotonic() - start_s
    assert 0.12 <= took_s < 2.0


async def test_nothing_passes_a_cut_path_until_it_heals(pair: Any, path: ImpairedPath) -> None:
    async with echo_through(pair, path, reliable=False) as (channel, came):
        path.is_cut = True
        channel.send("lost")
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(came.get(), 0.3)
        path.is_cut = False
        channel.send("found")
        assert await asyncio.wait_for(came.get(), WAIT_S) == "found"
    assert path.up.lost >= 1


async def test_lost_packets_stay_lost_on_an_unreliable_channel_and_come_late_on_a_reliable_one(
    pair: Any, path: ImpairedPath
) -> None:
    async def arrived(*, reliable: bool) -> int:
        path.become("pristine")
        async with echo_through(pair, path, reliable=reliable) as (channel, came):
            path.become(LinkProfile("lossy", loss=0.2))
            for number in range(100):
                channel.send(f"{number}")
                await asyncio.sleep(0.002)
            if not reliable:
                path.become("pristine")
                channel.send("last")
                messages = []
                while (message := await asyncio.wait_for(came.get(), WAIT_S)) != "last":
                    messages.append(message)
                return len(messages)
            path.become("pristine")
            return len([await asyncio.wait_for(came.get(), WAIT_S) for _ in range(100)])

    assert 30 < await arrived(reliable=False) < 95
    assert await arrived(reliable=True) == 100


async def test_a_bottleneck_limits_the_rate(pair: Any, path: ImpairedPath) -> None:
    async with echo_through(pair, path, reliable=True) as (channel, came):
        path.become(LinkProfile("narrow", rate_mbps=2))
        start_s = time.monotonic()
        for _ in range(8):
            channel.send(b"x" * 16_384)
        for _ in range(8):
            await asyncio.wait_for(came.get(), WAIT_S)
        took_s = time.monotonic() - start_s
    assert took_s > 8 * 16_384 * 8 / 2e6 * 0.9


def test_a_closed_path_leaves_no_thread_and_no_socket() -> None:
    with ImpairedPath("4g") as path:
        host, port = path.relayed("127.0.0.1", 9)
        assert (host, port) != ("127.0.0.1", 9)
        thread = path._thread
        assert thread.is_alive()
    assert not thread.is_alive()
    with pytest.raises(OSError, match="Bad file descriptor"):
        path._wake()
