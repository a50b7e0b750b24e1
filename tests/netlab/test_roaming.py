"""Networks change under a robot and its operators: control and data come back by themselves, and nothing reliable is
lost or comes twice."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Coroutine, Iterator
from contextlib import ExitStack
from typing import Any

import pytest
from laboratory.forwarding import Lab
from laboratory.roaming import Roamer, RoamingSite, roaming_site

from mosaic_core.operator import MosaicOperator
from mosaic_core.testing import until

pytestmark = [pytest.mark.netlab, pytest.mark.timeout(300)]
"""On a busy machine server and robot take a minute and a half to start. How soon control and data are back is measured
by `bench/roam.py`."""


@pytest.fixture(scope="module")
def roaming(
    tmp_path_factory: pytest.TempPathFactory, wait_for: Callable[..., float], lab: Lab
) -> Iterator[RoamingSite]:
    """Networks of their own: the addresses of the others' stay."""
    with ExitStack() as stack:
        folder = tmp_path_factory.mktemp("roaming")
        yield roaming_site(Lab(stack), folder, stack, wait_for)


def play(site: RoamingSite, body: Callable[[Roamer, MosaicOperator], Coroutine[Any, Any, None]]) -> None:
    """With an operator who drives, reads and writes all the time."""

    async def main() -> None:
        async with MosaicOperator(site.url, await site.token(), is_person=True) as operator:
            connection = await operator.connect(site.account["robotId"], timeout_s=20, reconnect=True)
            roamer = Roamer(site, connection)
            noted = len(site.noted())
            await roamer.begin()
            try:
                await body(roamer, operator)
            finally:
                await roamer.end()
            await until(lambda: len(site.noted()) >= noted + len(roamer.written), "all that was written arrived", 30)
            assert site.noted()[noted:] == roamer.written
            assert roamer.numbers == list(range(roamer.numbers[0], roamer.numbers[-1] + 1))
            assert roamer.gaps == []

    site.lab.operator.run(lambda: asyncio.run(main()))


async def restart(
    site: RoamingSite, operator: MosaicOperator, *, after: Callable[[], Coroutine[Any, Any, None]] | None = None
) -> None:
    """The server goes, and comes when `after` is done; when both ends, each with its back-off, are at it again."""
    await asyncio.to_thread(site.server.stop)
    if after is not None:
        await after()
    await until(lambda: not site.robot_is_at_the_server(), "the robot misses the server", 30)
    await asyncio.to_thread(site.start_server)
    await until(site.robot_is_at_the_server, "the robot is at the server again", 60)
    await operator._signaling.wait_ready(60)


@pytest.mark.parametrize("side", ["operator", "robot"])
def test_another_address_ends_no_session_and_costs_no_message(roaming: RoamingSite, side: Any) -> None:
    async def body(roamer: Roamer, operator: MosaicOperator) -> None:
        session_id = roamer.connection.session_id
        since_s = await asyncio.to_thread(roaming.cables.move, side)
        await roamer.back_after(since_s)
        assert roamer.connection.session_id == session_id
        assert roamer.connection.control.leases["motion"].is_mine

    play(roaming, body)


def test_another_cable_of_the_robot_ends_no_session_and_costs_no_message(roaming: RoamingSite) -> None:
    async def body(roamer: Roamer, operator: MosaicOperator) -> None:
        session_id = roamer.connection.session_id
        since_s = await asyncio.to_thread(roaming.cables.switch, "robot")
        await roamer.back_after(since_s)
        assert roamer.connection.session_id == session_id
        assert roamer.connection.control.leases["motion"].is_mine

    play(roaming, body)


def test_a_server_that_restarts_disturbs_no_live_peer_and_serves_the_next_loss(roaming: RoamingSite) -> None:
    async def body(roamer: Roamer, operator: MosaicOperator) -> None:
        peer_id, began_s = roamer.connection.peer_id, time.monotonic()
        await restart(roaming, operator)
        assert roamer.connection.peer_id == peer_id
        assert len([at_s for at_s in roamer.at_s if at_s > began_s]) > 20 * (time.monotonic() - began_s) * 0.8
        since_s = await asyncio.to_thread(roaming.cables.move, "operator")
        await roamer.back_after(since_s)

    play(roaming, body)


def test_a_loss_while_the_server_is_away_is_over_when_it_is_back(roaming: RoamingSite) -> None:
    async def body(roamer: Roamer, operator: MosaicOperator) -> None:
        moved_s: list[float] = []

        async def move() -> None:
            moved_s.append(await asyncio.to_thread(roaming.cables.move, "operator"))
            await until(lambda: roamer.connection.state == "reconnecting", "the operator misses the robot", 30)

        await restart(roaming, operator, after=move)
        await roamer.back_after(moved_s[0])

    play(roaming, body)
