"""The robot under measurement is a process of its own, as robots are; its server is a socket of the measuring one."""

from __future__ import annotations

import asyncio
import multiprocessing
from contextlib import suppress
from typing import Self

from mosaic_core.bench.line_socket import LINE_BYTES, LineSocket
from mosaic_core.bench.robot_side import run_robot
from mosaic_core.laboratory.memory_server import MemoryServer, MemorySocket

HOST = "127.0.0.1"
_END_S = 5.0


async def serve_lines(server: MemoryServer) -> asyncio.Server:
    """Let a robot in another process talk to ``server``."""

    async def robot_came(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        inner = await server.connect("ws://memory.invalid/ws/robot")
        outer = LineSocket(reader, writer)
        telling = asyncio.create_task(_tell(inner, outer))
        try:
            async for text in outer:
                await inner.send(text)
        finally:
            telling.cancel()
            await inner.close()
            writer.close()

    return await asyncio.start_server(robot_came, HOST, 0, limit=LINE_BYTES)


async def _tell(inner: MemorySocket, outer: LineSocket) -> None:
    with suppress(ConnectionError):
        async for text in inner:
            await outer.send(text)


class RobotProcess:
    """``with`` runs it. :meth:`take_obeyed` may be called from any one thread at a time."""

    def __init__(self, port: int) -> None:
        spawn = multiprocessing.get_context("spawn")
        self._pipe, theirs = spawn.Pipe()
        self._process = spawn.Process(target=run_robot, args=(HOST, port, theirs), daemon=True)
        self._theirs = theirs

    def __enter__(self) -> Self:
        self._process.start()
        self._theirs.close()
        return self

    def __exit__(self, *exception: object) -> None:
        self._pipe.close()
        self._process.join(_END_S)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()

    def take_obeyed(self) -> list[tuple[float, float]]:
        """What has reached the robot's ``handle_data`` since the last call; raises :class:`EOFError`."""
        self._pipe.send(None)
        taken: list[tuple[float, float]] = self._pipe.recv()
        return taken
