"""The network swallows everything while an operator drives: the robot stands in time, and stays."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from typing import Any

import pytest

from mosaic_core.operator import RobotConnection

pytestmark = [pytest.mark.netlab, pytest.mark.timeout(90)]

TIMEOUT_S = 0.3
MARGIN_S = 0.25
"""For a busy machine; bench/control.py measures what it is."""
CONNECTORS = """\
  - type: cmd-vel
    label: cmd_vel
    params: { drive: { type: callback, function: "drive_recorder:record" } }
    safety: { timeout_s: 0.3 }
  - { type: sim-pose, label: pose, params: { period_s: 0.05 } }
"""
TWIST = {"linear": {"x": 0.4}, "angular": {"z": 0.2}}


@asynccontextmanager
async def driving(connection: RobotConnection) -> AsyncIterator[None]:
    """Commands 20 times a second, whatever the network does."""
    pad = connection.sendable("cmd_vel")
    await pad.wait_open()

    async def drive() -> None:
        while True:
            pad.send_json(TWIST)
            await asyncio.sleep(0.05)

    task = asyncio.create_task(drive())
    try:
        yield
    finally:
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task


def test_a_robot_whose_operator_is_swallowed_by_the_network_stands_in_time(healed: Any, until: Any) -> None:
    async def body() -> None:
        async with await healed.sign_in() as operator:
            connection = await healed.connect(operator)
            async with driving(connection):
                await until(lambda: len(healed.track.moves()) > 5, "the robot moves")
                await asyncio.to_thread(healed.lab.cut)
                await until(healed.track.stands, "the robot stands")
        print(healed.track.lines()[-5:])

    healed.on_operators_side(body)
