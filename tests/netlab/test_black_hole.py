"""The network swallows what operator and robot send: the robot stands in time, and stays until a deliberate act."""

from __future__ import annotations

import asyncio
import time
from typing import Any

import pytest

pytestmark = [pytest.mark.netlab, pytest.mark.timeout(90)]

TIMEOUT_S = 0.3
MARGIN_S = 0.25
"""For a busy machine; bench/control.py measures what it is."""
RTT_CURVE_ENDS_S = 1.2
"""From this age of an unanswered ping on the default curve leaves no speed."""
CONNECTORS = """\
  - type: cmd-vel
    label: cmd_vel
    params: { drive: { type: callback, function: "drive_recorder:record_base" } }
    safety: { timeout_s: 0.3 }
  - { type: sim-pose, label: pose, params: { period_s: 0.05 } }
"""


async def cut_while_driving(site: Any, until: Any, connection: Any, **ways: bool) -> float:
    """When it was cut. Whoever drives goes on for a second, and is not at the controls any more afterwards."""
    async with site.driving(connection):
        await asyncio.to_thread(site.lab.cut, **ways)
        cut_s = time.monotonic()
        await until(site.track.stands, "the robot stands")
        await asyncio.sleep(1.0)
    return cut_s


def test_a_short_hole_in_the_network_stops_the_robot_and_nothing_old_moves_it_afterwards(
    healed: Any, until: Any
) -> None:
    async def body() -> None:
        async with healed.connected() as connection:
            await connection.control.take()
            cut_s = await cut_while_driving(healed, until, connection)
            assert healed.track.silence_s(cut_s) < TIMEOUT_S + MARGIN_S
            await asyncio.to_thread(healed.lab.heal)
            for _ in range(10):
                await connection.receivable("pose").next_message()
            assert healed.track.moves(healed.track.stopped_s(cut_s)) == []
            async with healed.driving(connection):
                pass

    healed.on_operators_side(body)


def test_after_a_long_hole_the_robot_stands_until_somebody_commands_it_anew(healed: Any, until: Any) -> None:
    async def body() -> None:
        async with healed.connected() as connection:
            await connection.control.take()
            cut_s = await cut_while_driving(healed, until, connection)
            assert healed.track.silence_s(cut_s) < TIMEOUT_S + MARGIN_S
            await until(lambda: connection.state == "closed", "the operator notices")
        await asyncio.to_thread(healed.lab.heal)
        async with healed.connected() as connection:
            assert healed.track.moves(healed.track.stopped_s(cut_s)) == []
            await connection.control.wait_for(lambda: not connection.control.leases["motion"].holder)
            await connection.control.take()
            async with healed.driving(connection):
                pass

    healed.on_operators_side(body)


def test_an_operator_whose_commands_vanish_but_who_hears_everything_stops_the_robot_by_silence(
    healed: Any, until: Any
) -> None:
    async def body() -> None:
        async with healed.connected() as connection:
            await connection.control.take()
            cut_s = await cut_while_driving(healed, until, connection, to_operator=False)
            assert healed.track.silence_s(cut_s) < TIMEOUT_S + MARGIN_S

    healed.on_operators_side(body)


def test_an_operator_who_hears_nothing_more_drives_nobody_however_many_commands_arrive(healed: Any, until: Any) -> None:
    async def body() -> None:
        async with healed.connected() as connection:
            await connection.control.take()
            async with healed.driving(connection):
                await asyncio.to_thread(healed.lab.cut, to_robot=False)
                cut_s = time.monotonic()
                await until(healed.track.stands, "the robot stands")
                assert healed.track.stopped_s(cut_s) - cut_s < 0.5 + RTT_CURVE_ENDS_S + MARGIN_S
                await until(lambda: connection.state == "closed", "the operator notices")
                assert healed.track.stands()

    healed.on_operators_side(body)
