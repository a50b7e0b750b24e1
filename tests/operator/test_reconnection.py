"""A connection that comes back by itself: same session, stores and leases survive, and its end is still an end."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest

from mosaic_core.operator import LeaseLost
from mosaic_core.testing import until
from mosaic_core.words import control, signaling

WAIT_S = 8.0


@asynccontextmanager
async def with_kept(world: Any) -> AsyncIterator[Any]:
    async with asyncio.timeout(40), world.operator() as operator:
        yield await operator.connect(world.robot_id, timeout_s=WAIT_S, reconnect=True)


def offers(world: Any) -> int:
    return sum(isinstance(message, signaling.SdpOffer) for message in world.server.received)


async def test_stores_and_a_lease_come_back_in_the_same_session(world: Any) -> None:
    async with with_kept(world) as connection:
        pad = connection.sendable("cmd_vel")
        await pad.wait_open(WAIT_S)
        lease = await connection.control.take()
        ended: list[str] = []
        connection.on_closed(lambda error: ended.append(error.code))
        world.robot.say(control.Bye(code="peer.shutdown"))
        assert connection.state == "reconnecting"
        assert pad.state.phase == "reconnecting"
        assert lease.lost is not None
        assert connection.control.epoch_of("motion") == 0
        await until(lambda: connection.state == "connected" and lease.is_held)
        await pad.wait_open(WAIT_S)
        assert pad.send_json({})
        assert world.robot.channels["cmd_vel"].frames()[-1].epoch == lease.epoch == 8
        assert ended == []
        body = json.loads([r for r in world.server.requests if r.url.path.endswith("/connection")][-1].content)
        assert body["sessionId"] == "session-1"


async def test_a_lease_that_comes_back_again_and_again_is_asked_for_once_each_time(world: Any) -> None:
    async with with_kept(world) as connection:
        lease = await connection.control.take()
        for losses in range(1, 5):
            world.robot.say(control.Bye(code="peer.shutdown"))
            await until(lambda: connection.state == "connected" and lease.is_held)
            await asyncio.sleep(0)
            assert len(world.robot.said(control.LeaseRequest)) == 1 + losses


async def test_a_lease_of_a_block_is_lost_for_good_and_not_asked_for_again(world: Any) -> None:
    async with with_kept(world) as connection:

        async def drive() -> None:
            async with await connection.control.take():
                world.robot.say(control.Bye(code="peer.shutdown"))
                await asyncio.sleep(WAIT_S)

        with pytest.raises(LeaseLost):
            await drive()
        asked = len(world.robot.said(control.LeaseRequest))
        await until(lambda: connection.state == "connected")
        await asyncio.sleep(0.05)
        assert len(world.robot.said(control.LeaseRequest)) == asked


async def test_it_goes_on_trying_while_the_robot_is_away(world: Any) -> None:
    async with with_kept(world) as connection:
        world.server.refusal = (404, {"resultCode": "ROBOT_WS_SESSION_NOT_EXIST"})
        requests = len(world.server.requests)
        world.robot.say(control.Bye(code="peer.shutdown"))
        await until(lambda: len(world.server.requests) >= requests + 2)
        assert connection.state == "reconnecting"
        world.server.refusal = None
        await until(lambda: connection.state == "connected")
        assert connection.error is None


@pytest.mark.parametrize("code", ["peer.not_allowed", "peer.replaced", "auth.expired"])
async def test_an_end_that_trying_again_would_not_help_is_an_end(world: Any, code: str) -> None:
    async with with_kept(world) as connection:
        world.robot.say(control.Bye(code=code))
        assert connection.state == "closed"
        assert (await connection.wait_closed()).code == code
        before = offers(world)
        await asyncio.sleep(0.5)
        assert offers(world) == before


async def test_what_is_made_anew_has_not_ended(world: Any) -> None:
    async with with_kept(world) as connection:
        world.server.refusal = (404, {"resultCode": "ROBOT_WS_SESSION_NOT_EXIST"})
        world.robot.say(control.Bye(code="peer.shutdown"))
        assert connection.state == "reconnecting"
        waiting = asyncio.create_task(connection.wait_closed())
        await asyncio.sleep(0)
        assert not waiting.done()
        await connection.close()
        assert (await waiting).code == "peer.closed"


async def test_closing_while_it_tries_ends_the_trying(world: Any) -> None:
    async with with_kept(world) as connection:
        world.robot.say(control.Bye(code="peer.shutdown"))
        assert connection.state == "reconnecting"
        before = offers(world)
        await connection.close()
        assert (await connection.wait_closed()).code == "peer.closed"
        await asyncio.sleep(0.5)
        assert offers(world) == before


async def test_without_being_asked_it_does_not_come_back(world: Any) -> None:
    async with asyncio.timeout(20), world.operator() as operator:
        connection = await operator.connect(world.robot_id, timeout_s=WAIT_S)
        world.robot.say(control.Bye(code="peer.shutdown"))
        assert connection.state == "closed"
