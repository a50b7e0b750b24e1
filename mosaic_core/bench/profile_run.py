"""One row of the table: a robot and an operator meet over one network, are measured, lose it for two seconds."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable
from contextlib import AsyncExitStack, asynccontextmanager

from mosaic_core.bench.figures import Figures, figures
from mosaic_core.bench.robot_process import RobotProcess, serve_lines
from mosaic_core.bench.scene import CAMERA, COMMANDS, VALUES
from mosaic_core.bench.watching import Watcher
from mosaic_core.laboratory.joining import ROBOT_ID
from mosaic_core.laboratory.memory_server import BASE_URL, MemoryServer
from mosaic_core.laboratory.networks import WebRtcNetwork
from mosaic_core.machines.laboratory.impaired_link import LinkProfile
from mosaic_core.machines.laboratory.nat import NatKind
from mosaic_core.operator import MosaicOperator, RobotConnection
from mosaic_core.words.errors import ConnectionFailed
from mosaic_core.words.signaling import RobotStatus

START_S = 30.0
CONNECT_S = 30.0
SETTLE_S = 2.0
"""Until the encoder has found the link's rate; what comes before is told by the set-up time."""
CUT_S = 2.0
RECOVERY_S = 20.0
Told = Callable[[str], None]


async def measured(profile: LinkProfile, seconds: float, nat: NatKind | None, tell: Told) -> Figures:
    """Takes ``seconds`` and about eight more; ``tell`` hears what it is at. Raises :class:`TimeoutError` if the robot
    does not start."""
    async with AsyncExitStack() as stack:
        network = stack.enter_context(WebRtcNetwork(profile, nat=nat))
        tell("starting the robot")
        robot, operator = await stack.enter_async_context(_site(network))
        tell("connecting")
        start_s = time.monotonic()
        try:
            connection = await operator.connect(ROBOT_ID, timeout_s=CONNECT_S, reconnect=True)
            connect_s, first_picture_s = await _firsts(connection, start_s)
        except ConnectionFailed as error:
            return Figures(profile.name, failure=error.code)
        except TimeoutError:
            return Figures(profile.name, failure="media.timeout")
        watcher = await stack.enter_async_context(Watcher(connection, robot, network.path.down).at_work())
        await asyncio.sleep(SETTLE_S)
        tell("measuring")
        seen = await watcher.seen(seconds)
        tell("cutting the cable for two seconds")
        network.cut()
        await asyncio.sleep(CUT_S)
        network.heal()
        healed_s = time.monotonic()
        tell("waiting for it to recover")
        recovery_s = await watcher.well_again(healed_s, RECOVERY_S)
        return figures(profile.name, connect_s, first_picture_s, seen, recovery_s)


@asynccontextmanager
async def _site(network: WebRtcNetwork) -> AsyncIterator[tuple[RobotProcess, MosaicOperator]]:
    """A robot that is ready, and an operator who is signed in."""
    server = MemoryServer(ROBOT_ID, network.robot_ice_servers)
    async with await serve_lines(server) as lines, AsyncExitStack() as stack:
        keeping = asyncio.create_task(server.keep_alive())
        stack.callback(keeping.cancel)
        robot = RobotProcess(lines.sockets[0].getsockname()[1])
        await asyncio.to_thread(robot.__enter__)  # the loop must go on: the robot talks to the server on it
        stack.push_async_callback(asyncio.to_thread, robot.__exit__, None, None, None)
        operator = MosaicOperator(
            BASE_URL, "Alice", open_socket=server.connect, make_offerer=network.offerer, http=server.http()
        )
        await stack.enter_async_context(operator)
        await operator.wait_status(ROBOT_ID, RobotStatus.READY_TO_CONNECT, START_S)
        yield robot, operator


async def _firsts(connection: RobotConnection, start_s: float) -> tuple[float, float]:
    """Seconds from ``start_s`` to the first value and to the first picture."""

    async def first_value() -> float:
        await connection.receivable(VALUES).next_message(CONNECT_S)
        return time.monotonic() - start_s

    async def first_picture() -> float:
        await connection.media(CAMERA).next_frame(CONNECT_S)
        return time.monotonic() - start_s

    value_s, picture_s = await asyncio.gather(first_value(), first_picture())
    await connection.sendable(COMMANDS).wait_open(CONNECT_S)
    return value_s, picture_s
