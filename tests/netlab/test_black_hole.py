"""The network swallows what operator and robot send: the robot stands in time, and stays until a deliberate act."""

from __future__ import annotations

import asyncio
import time
from typing import Any

import pytest

pytestmark = [pytest.mark.netlab, pytest.mark.timeout(90)]

TIMEOUT_S = 0.3
MARGIN_S = 0.5
LEASE_WAIT_S = 20.0
"""The operator of the test before may still hold it, until the robot has noticed that it is gone."""
"""For a busy machine; bench/control.py measures what it is."""
FULL_MPS = 0.4
RTT_CURVE_ENDS_S = 1.2
"""From this age of an unanswered ping on the default curve leaves no speed."""


async def cut_while_driving(site: Any, until: Any, connection: Any, **ways: bool) -> None:
    """Whoever drives goes on for a second, and is not at the controls any more afterwards."""
    async with site.driving(connection):
        await asyncio.to_thread(site.lab.cut, **ways)
        await until(site.track.stands, "the robot stands")
        await asyncio.sleep(1.0)
    assert site.track.silence_s() < TIMEOUT_S + MARGIN_S


def is_free(connection: Any) -> bool:
    lease = connection.control.leases.get("motion")
    return lease is not None and lease.holder is None


async def heal(site: Any) -> float:
    """When the network began to be whole again."""
    healing_s = time.monotonic()
    await asyncio.to_thread(site.lab.heal)
    return healing_s


def test_a_short_hole_in_the_network_stops_the_robot_and_nothing_old_moves_it_afterwards(site: Any, until: Any) -> None:
    async def body() -> None:
        async with site.connected() as connection:
            await connection.control.take(wait_s=LEASE_WAIT_S)
            await cut_while_driving(site, until, connection)
            healed_s = await heal(site)
            for _ in range(10):
                await connection.receivable("pose").next_message()
            assert site.track.moves(healed_s) == []
            async with site.driving(connection):
                pass

    site.on_operators_side(body)


def test_after_a_long_hole_the_robot_stands_until_somebody_commands_it_anew(site: Any, until: Any) -> None:
    async def body() -> None:
        async with site.connected() as connection:
            await connection.control.take(wait_s=LEASE_WAIT_S)
            await cut_while_driving(site, until, connection)
            await until(lambda: connection.state == "closed", "the operator notices")
        healed_s = await heal(site)
        async with site.connected() as connection:
            assert site.track.moves(healed_s) == []
            await connection.control.wait_for(lambda: is_free(connection))
            await connection.control.take()
            async with site.driving(connection):
                pass

    site.on_operators_side(body)


def test_an_operator_whose_commands_vanish_but_who_hears_everything_stops_the_robot_by_silence(
    site: Any, until: Any
) -> None:
    async def body() -> None:
        async with site.connected() as connection:
            await connection.control.take(wait_s=LEASE_WAIT_S)
            await cut_while_driving(site, until, connection, to_operator=False)

    site.on_operators_side(body)


def test_who_hears_nothing_more_drives_slower_and_then_not_at_all_however_many_commands_arrive(
    site: Any, until: Any
) -> None:
    async def body() -> None:
        async with site.connected() as connection:
            await connection.control.take(wait_s=LEASE_WAIT_S)
            async with site.driving(connection):
                await asyncio.to_thread(site.lab.cut, to_robot=False)
                cut_s = time.monotonic()
                await until(lambda: connection.state == "closed", "the operator notices")
                await until(site.track.stands, "the robot stands")
            speeds_mps = site.track.speeds_mps(cut_s)
            assert min(filter(None, speeds_mps)) < FULL_MPS / 2
            assert site.track.moves()[-1] - cut_s < 0.5 + RTT_CURVE_ENDS_S + MARGIN_S

    site.on_operators_side(body)
