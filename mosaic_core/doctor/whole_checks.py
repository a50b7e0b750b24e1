"""A whole connection as an operator makes it: through the server, to the robot or a stand-in for one that is offline.

The stand-in uses the robot's identity, so it is made only while the robot itself is not connected: the newest wins.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass

from mosaic_core.doctor.path_trials import measured_path
from mosaic_core.doctor.peer_checks import WANTED_PATH_BPS, speed_finding
from mosaic_core.operator import MosaicOperator, RobotConnection
from mosaic_core.runtime.robot import Robot
from mosaic_core.words.errors import MosaicError
from mosaic_core.words.finding import Finding, failed, passed, warned
from mosaic_core.words.signaling import RobotStatus

CONNECT_TIMEOUT_S = 10.0
STAND_IN_TIMEOUT_S = 6.0


PATH_CURE = (
    "See what else uses the network of either side, and how good the radio is; a camera needs about 2 Mbit/s: "
    "lower its size, rate or `max_bitrate_bps`."
)
_ACCOUNT_CURES = {
    "auth.failed": "Check the account's e-mail and password (`--email`, `MOSAIC_PASSWORD`); a one-time code works "
    "once, and not for long."
}
"""The table's cure is for robots as well."""


@dataclass(frozen=True, slots=True)
class _Tried:
    """A connection that is tried, and the words by which it is told of."""

    check: str
    what: str
    speed_check: str
    path: str


_WHOLE = _Tried("whole.connection", "A whole connection", "whole.throughput", "The whole path")
_RELAYED = _Tried(
    "whole.relay", "A whole connection through TURN", "whole.relay_throughput", "The whole path through TURN"
)


@dataclass(frozen=True, slots=True)
class WholeWay:
    """The robot and the account that the whole way connects; ``sign_in`` raises :class:`MosaicError`."""

    robot_id: str
    sign_in: Callable[[], Awaitable[MosaicOperator]]
    stand_in: Callable[[], Robot]


async def whole_checks(way: WholeWay) -> AsyncIterator[Finding]:
    """Directly, and once more through the relay alone if the server hands one out."""
    try:
        operator = await way.sign_in()
    except MosaicError as error:
        yield failed("whole.sign_in", error.code, error.message, _ACCOUNT_CURES.get(error.code, error.cure))
        return
    async with operator:
        yield passed("whole.sign_in", "The account may sign in.")
        try:
            async with _robot(operator, way):
                async for finding in _connected(operator, way.robot_id, _WHOLE):
                    yield finding
                if any(url.startswith("turn") for server in await operator.rest.ice_servers() for url in server.urls):
                    operator.ice_transport_policy = "relay"
                    async for finding in _connected(operator, way.robot_id, _RELAYED):
                        yield finding
        except (MosaicError, TimeoutError) as error:
            code = error.code if isinstance(error, MosaicError) else "signal.robot_offline"
            yield failed("whole.connection", code, f"The robot is not there: {error or 'no answer'}")


@asynccontextmanager
async def _robot(operator: MosaicOperator, way: WholeWay) -> AsyncIterator[None]:
    """The robot while it is online, else its stand-in."""
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


async def _connected(operator: MosaicOperator, robot_id: str, tried: _Tried) -> AsyncIterator[Finding]:
    try:
        connection = await operator.connect(robot_id, timeout_s=CONNECT_TIMEOUT_S)
    except MosaicError as error:
        timeline = operator.timelines[robot_id]
        text = f"{tried.what} failed: {error.message} ({timeline.summary()})"
        yield failed(tried.check, error.code, text, error.cure, {"timeline": timeline.wire()})
        return
    try:
        yield _told(connection, tried.check, tried.what)
        yield await _measured(connection, tried)
    finally:
        await connection.close()


async def _measured(connection: RobotConnection, tried: _Tried) -> Finding:
    try:
        path = await measured_path(connection)
    except (MosaicError, TimeoutError):
        text = f"{tried.path}: nothing came through that could be measured."
        return warned(tried.speed_check, "check.slow_path", text, PATH_CURE)
    return speed_finding(tried.speed_check, f"{tried.path}, {path.way}", path, WANTED_PATH_BPS, PATH_CURE)


def _told(connection: RobotConnection, check: str, what: str) -> Finding:
    timeline = connection.timeline
    took_ms = timeline.at_ms("catalogue") or timeline.at_ms("control") or 0.0
    path = next((mark.detail.partition(":")[0] for mark in timeline.marks if mark.moment == "ice"), "")
    where = f", {path}" if path else ""
    return passed(check, f"{what} works: {took_ms:.0f} ms until it can be used{where}.", timeline=timeline.wire())
