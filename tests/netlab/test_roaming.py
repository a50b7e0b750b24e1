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

pytestmark = [pytest.mark.netlab, pytest.mark.timeout(120)]

BACK_S = 6.0
"""Generous: `bench/roam.py` measures it."""


@pytest.fixture(scope="module")
def roaming(
    tmp_path_factory: pytest.TempPathFactory, wait_for: Callable[..., float], lab: Lab
) -> Iterator[RoamingSite]:
    """Networks of their own: the addresses of the others' stay."""
    with ExitStack() as stack:
        folder = tmp_path_factory.mktemp("roaming")
        yield roaming_site(Lab(stack), folder, stack, wait_for)


def play(site: RoamingSite, body: Callable[[Roamer], Coroutine[Any, Any, None]]) -> None:
    """With an operator who drives, reads and writes all the time."""

    async def main() -> None:
        async with MosaicOperator(site.url, await site.token(), is_person=True) as operator:
            connection = await operator.connect(site.account["robotId"], timeout_s=20, reconnect=True)
            roamer = Roamer(site, connection)
            noted = len(site.noted())
            await roamer.begin()
            try:
                await body(roamer)
            finally:
                await roamer.end()
            await until_noted(site, noted + len(roamer.written))
            assert site.noted()[noted:] == roamer.written
            assert roamer.numbers == list(range(roamer.numbers[0], roamer.numbers[-1] + 1))
            assert roamer.gaps == []

    site.lab.operator.run(lambda: asyncio.run(main()))


async def until_noted(site: RoamingSite, count: int) -> None:
    async with asyncio.timeout(5):
        while len(site.noted()) < count:  # noqa: ASYNC110 - a file of another process
            await asyncio.sleep(0.02)


@pytest.mark.parametrize("side", ["operator", "robot"])
def test_another_address_costs_seconds_and_no_message(roaming: RoamingSite, side: Any) -> None:
    async def body(roamer: Roamer) -> None:
        session_id = roamer.connection.session_id
        since_s = await asyncio.to_thread(roaming.cables.move, side)
        data_s, control_s = await roamer.back_after(since_s)
        assert max(data_s, control_s) < BACK_S
        assert roamer.connection.session_id == session_id
        assert roamer.connection.control.leases["motion"].is_mine

    play(roaming, body)


def test_another_cable_of_the_robot_costs_seconds_and_no_message(roaming: RoamingSite) -> None:
    async def body(roamer: Roamer) -> None:
        since_s = await asyncio.to_thread(roaming.cables.switch, "robot")
        assert max(await roamer.back_after(since_s)) < BACK_S

    play(roaming, body)


def test_a_server_that_restarts_disturbs_no_live_peer_and_serves_the_next_loss(roaming: RoamingSite) -> None:
    async def body(roamer: Roamer) -> None:
        peer_id, began_s = roamer.connection.peer_id, time.monotonic()
        await asyncio.to_thread(roaming.server.stop)
        await asyncio.to_thread(roaming.start_server)
        await asyncio.sleep(2.5)  # both ends come back to it with their back-off
        assert roamer.connection.peer_id == peer_id
        assert len([at_s for at_s in roamer.at_s if at_s > began_s]) > 20 * (time.monotonic() - began_s) * 0.8
        since_s = await asyncio.to_thread(roaming.cables.move, "operator")
        assert max(await roamer.back_after(since_s)) < BACK_S

    play(roaming, body)


def test_a_loss_while_the_server_is_away_is_over_when_it_is_back(roaming: RoamingSite) -> None:
    async def body(roamer: Roamer) -> None:
        await asyncio.to_thread(roaming.server.stop)
        since_s = await asyncio.to_thread(roaming.cables.move, "operator")
        await asyncio.sleep(2.0)
        assert roamer.connection.state == "reconnecting"
        await asyncio.to_thread(roaming.start_server)
        started_s = time.monotonic()
        data_s, control_s = await roamer.back_after(since_s, 30.0)
        assert since_s + max(data_s, control_s) < started_s + 2 * BACK_S

    play(roaming, body)
