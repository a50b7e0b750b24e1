"""`mosaic arm follow` as a service would end it."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest
from support.processes import MOSAIC, Process

from mosaic_core.messages import JointState
from mosaic_core.operator import MosaicOperator, RobotConnection

CONNECTORS = """\
  - { type: arm-joints, label: joints, params: { arm: &arm { bus: fake } } }
  - { type: arm-state, label: joint_state, params: { arm: *arm } }
"""
FOLLOW = ["arm", "follow", "Test robot", "joints", "--leader-bus", "fake", "--leader-port", "leader", "--json"]
PATIENCE_S = 60.0


@asynccontextmanager
async def looking(server: Any, seed: Any) -> AsyncIterator[RobotConnection]:
    async with await MosaicOperator.login(server.url, seed.email, seed.password) as operator:
        yield await operator.connect(seed.robot_id, timeout_s=PATIENCE_S)


async def shoulders(connection: RobotConnection) -> AsyncIterator[float]:
    async for received in connection.receivable("joint_state").messages():
        yield JointState.model_validate_json(received.data).positions[1]


@pytest.mark.webrtc
async def test_ended_by_sigterm_it_gives_the_lease_back_and_the_follower_stands(
    server: Any, seed: Any, start_robot: Any
) -> None:
    await asyncio.to_thread(start_robot, CONNECTORS)
    account = {"MOSAIC_SERVER": server.url, "MOSAIC_EMAIL": seed.email, "MOSAIC_PASSWORD": seed.password}
    follow = Process([*MOSAIC, *FOLLOW], account)
    async with looking(server, seed) as connection, asyncio.timeout(PATIENCE_S):
        follow.start()
        try:
            async for angle_rad in shoulders(connection):  # the leader sinks 0.23 rad a second
                if angle_rad < -0.15:
                    break
            held_by = connection.control.leases["arm"].holder
        finally:
            code = await asyncio.to_thread(follow.stop)
        assert (code, held_by is not None) == (0, True), follow.log
        await connection.control.wait_for(lambda: connection.control.leases["arm"].holder is None)
        angles = shoulders(connection)
        seen = [await anext(angles) for _ in range(20)]
    assert max(seen[5:]) - min(seen[5:]) < 0.01
