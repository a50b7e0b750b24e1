"""A peer connection that has much to read lets others run meanwhile."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace
from typing import Any

import pytest

from mosaic_core.adapters.aiortc_private.ice import fair_turns
from mosaic_core.adapters.aiortc_private.ice.fair_turns import take_turns

DATAGRAMS = 50


def transport_with(datagrams: int) -> Any:
    queue: asyncio.Queue[bytes] = asyncio.Queue()
    for number in range(datagrams):
        queue.put_nowait(bytes([number]))
    return SimpleNamespace(_recv=queue.get, _connection=SimpleNamespace(_queue=queue))


async def turns_of_others(transport: Any, datagrams: int) -> int:
    """How often another task ran while ``datagrams`` were read."""
    turns = 0

    async def other() -> None:
        nonlocal turns
        while True:
            turns += 1
            await asyncio.sleep(0)

    task = asyncio.create_task(other())
    assert [await transport._recv() for _ in range(datagrams)] == [bytes([number]) for number in range(datagrams)]
    task.cancel()
    return turns


async def test_others_run_between_datagrams_that_take_long(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fair_turns, "TURN_S", -1.0)

    transport = transport_with(DATAGRAMS)
    assert await turns_of_others(transport, DATAGRAMS) == 0
    transport = transport_with(DATAGRAMS)
    take_turns(transport)
    assert await turns_of_others(transport, DATAGRAMS) >= DATAGRAMS - 1


async def test_a_few_datagrams_are_read_in_one_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fair_turns, "TURN_S", 60.0)

    transport = transport_with(DATAGRAMS)
    take_turns(transport)
    await asyncio.sleep(0)
    assert await turns_of_others(transport, DATAGRAMS) <= 1


async def test_a_reader_who_waits_gets_what_comes() -> None:
    transport = transport_with(0)
    take_turns(transport)
    take_turns(transport)
    waiting = asyncio.create_task(transport._recv())
    await asyncio.sleep(0)
    transport._connection._queue.put_nowait(b"late")
    assert await waiting == b"late"
