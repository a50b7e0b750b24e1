"""Runs one row of the table: a robot and an operator meet over one network, are measured, lose it for two seconds."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Callable
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from typing import Any

from mosaic_core.bench.figures import Figures, Seen, figures
from mosaic_core.bench.robot_process import RobotProcess, serve_lines
from mosaic_core.bench.scene import CAMERA, COMMANDS, VALUES
from mosaic_core.bench.time_stripe import read_age_ms
from mosaic_core.laboratory.joining import ROBOT_ID
from mosaic_core.laboratory.memory_server import BASE_URL, MemoryServer
from mosaic_core.laboratory.networks import WebRtcNetwork
from mosaic_core.machines.laboratory.impaired_link import ImpairedLink, LinkProfile
from mosaic_core.machines.laboratory.nat import NatKind
from mosaic_core.operator import MosaicOperator, RobotConnection
from mosaic_core.words.errors import ConnectionFailed
from mosaic_core.words.signaling import RobotStatus

COMMAND_PERIOD_S = 0.02
LATE_S = 0.5
"""How long after the end of the time that is measured a command may still arrive."""
POLL_S = 0.02


class Watcher:
    """Looks at the pictures and commands the robot of one run. Event loop only. ``down`` is the link that carries
    everything to the operator.
    """

    def __init__(self, connection: RobotConnection, robot: RobotProcess, down: ImpairedLink) -> None:
        self._connection = connection
        self._robot = robot
        self._down = down
        self._pictures: list[tuple[float, float | None]] = []
        self._sent_s: list[float] = []
        self._obeyed: list[tuple[float, float]] = []

    @asynccontextmanager
    async def at_work(self) -> AsyncIterator[Watcher]:
        """Looking and commanding until the end of the block, whatever happens to the connection."""
        tasks = [asyncio.create_task(work()) for work in (self._look, self._command, self._ask)]
        try:
            yield self
        finally:
            for task in tasks:
                task.cancel()
            done = await asyncio.gather(*tasks, return_exceptions=True)
        for result in done:
            if isinstance(result, Exception):
                raise result

    async def seen(self, seconds: float) -> Seen:
        """What happens from now on for so long."""
        began_at_s, carried_bytes = time.monotonic(), self._down.carried_bytes
        await asyncio.sleep(seconds)
        ended_at_s, carried_bytes = time.monotonic(), self._down.carried_bytes - carried_bytes
        await asyncio.sleep(LATE_S)
        pictures = [(at_s, age) for at_s, age in self._pictures if began_at_s <= at_s < ended_at_s]
        obeyed = [(sent_s, at_s) for sent_s, at_s in self._obeyed if began_at_s <= sent_s < ended_at_s]
        return Seen(
            began_at_s=began_at_s,
            ended_at_s=ended_at_s,
            pictures_at_s=[at_s for at_s, _ in pictures],
            picture_ages_ms=[age for _, age in pictures if age is not None],
            commands_sent=sum(began_at_s <= sent_s < ended_at_s for sent_s in self._sent_s),
            command_ages_ms=[1000 * (at_s - sent_s) for sent_s, at_s in obeyed],
            carried_bytes=carried_bytes,
        )

    async def well_again(self, since_s: float, timeout_s: float) -> float | None:
        """How long after ``since_s`` a command and a picture have passed that were not made before; ``None``: not in
        time."""
        with suppress(TimeoutError):
            async with asyncio.timeout(timeout_s):
                while (at_s := self._both_passed_s(since_s)) is None:  # noqa: ASYNC110 - noted in another process
                    await asyncio.sleep(POLL_S)
                return at_s - since_s
        return None

    def _both_passed_s(self, since_s: float) -> float | None:
        commands = (at_s for sent_s, at_s in self._obeyed if sent_s >= since_s)
        pictures = (at_s for at_s, age in self._pictures if age is not None and at_s - age / 1000 >= since_s)
        firsts = next(commands, None), next(pictures, None)
        return None if firsts[0] is None or firsts[1] is None else max(firsts[0], firsts[1])

    async def _look(self) -> None:
        async for frame in self._connection.media(CAMERA).frames():
            now_s = time.monotonic()
            self._pictures.append((now_s, read_age_ms(_luma(frame), now_s)))

    async def _command(self) -> None:
        pad = self._connection.sendable(COMMANDS)
        while True:
            sent_s = time.monotonic()
            self._sent_s.append(sent_s)
            pad.send_json({"sent_s": sent_s})
            await asyncio.sleep(COMMAND_PERIOD_S)

    async def _ask(self) -> None:
        while True:
            self._obeyed += await asyncio.to_thread(self._robot.take_obeyed)
            await asyncio.sleep(POLL_S)


def _luma(frame: Any) -> Any:
    return frame.to_ndarray(format="gray8") if frame.format.name == "gray" else frame.to_ndarray()[: frame.height]


START_S = 30.0
CONNECT_S = 30.0
SETTLE_S = 2.0
"""Until the encoder has found the link's rate; what comes before is told by the set-up time."""
CUT_S = 2.0
RECOVERY_S = 20.0
TellLine = Callable[[str], None]


async def measured(profile: LinkProfile, seconds: float, nat: NatKind | None, tell: TellLine) -> Figures:
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
            return Figures(profile.name, failure="media.no_first_frame")
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
