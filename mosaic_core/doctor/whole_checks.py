"""A whole connection as an operator makes it: through the server, to the robot or a stand-in for one that is offline.

The stand-in uses the robot's identity, so it is made only while the robot itself is not connected: the newest wins.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from dataclasses import dataclass
from typing import Protocol

from mosaic_core.operator import MosaicOperator, RobotConnection
from mosaic_core.words.errors import MosaicError
from mosaic_core.words.finding import Finding, failed, passed
from mosaic_core.words.signaling import RobotStatus

CONNECT_TIMEOUT_S = 10.0
STAND_IN_TIMEOUT_S = 6.0


class StandIn(Protocol):
    """What is needed of a robot."""

    async def run(self) -> None: ...
    def stop(self) -> None: ...


@dataclass(frozen=True, slots=True)
class WholeWay:
    """Who connects to what; ``sign_in`` raises :class:`MosaicError`."""

    robot_id: str
    sign_in: Callable[[], Awaitable[MosaicOperator]]
    stand_in: Callable[[], StandIn]


async def whole_checks(way: WholeWay) -> AsyncIterator[Finding]:
    """Directly, and once more through the relay alone if the server hands one out."""
    try:
        operator = await way.sign_in()
    except MosaicError as error:
        yield failed("whole.sign_in", error.code, error.message, error.cure)
        return
    async with operator:
        yield passed("whole.sign_in", "The account may sign in.")
        try:
            async with _robot(operator, way):
                yield await _connected(operator, way.robot_id, "whole.connection", "A whole connection")
                if any(url.startswith("turn") for server in await operator.rest.ice_servers() for url in server.urls):
                    operator.ice_transport_policy = "relay"
                    yield await _connected(operator, way.robot_id, "whole.relay", "A whole connection through TURN")
        except (MosaicError, TimeoutError) as error:
            code = error.code if isinstance(error, MosaicError) else "signal.robot_offline"
            yield failed("whole.connection", code, f"The robot is not there: {error or 'no answer'}")


def _robot(operator: MosaicOperator, way: WholeWay) -> AbstractAsyncContextManager[None]:
    @asynccontextmanager
    async def there() -> AsyncIterator[None]:
        robots = {robot.id: robot for robot in await operator.robots()}
        known = robots.get(way.robot_id)
        if known is not None and known.is_online:
            yield
            return
        stand_in = way.stand_in()
        running = asyncio.create_task(stand_in.run())
        try:
            await operator.wait_status(way.robot_id, RobotStatus.READY_TO_CONNECT, STAND_IN_TIMEOUT_S)
            yield
        finally:
            stand_in.stop()
            await asyncio.wait({running}, timeout=3)
            running.cancel()

    return there()


async def _connected(operator: MosaicOperator, robot_id: str, check: str, what: str) -> Finding:
    try:
        connection = await operator.connect(robot_id, timeout_s=CONNECT_TIMEOUT_S)
    except MosaicError as error:
        timeline = operator.timelines[robot_id]
        text = f"{what} failed: {error.message} ({timeline.summary()})"
        return failed(check, error.code, text, error.cure, {"timeline": timeline.wire()})
    try:
        return _told(connection, check, what)
    finally:
        await connection.close()


def _told(connection: RobotConnection, check: str, what: str) -> Finding:
    timeline = connection.timeline
    took_ms = timeline.at_ms("catalogue") or timeline.at_ms("control") or 0.0
    path = next((mark.detail.partition(":")[0] for mark in timeline.marks if mark.moment == "ice"), "")
    where = f", {path}" if path else ""
    return passed(check, f"{what} works: {took_ms:.0f} ms until it can be used{where}.", timeline=timeline.wire())
