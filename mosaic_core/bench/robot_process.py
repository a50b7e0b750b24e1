"""The robot under measurement is a process of its own, as robots are; its server is a socket of the measuring one, on
which every line is a signaling frame. WebRTC is imported where the robot runs.
"""

from __future__ import annotations

import asyncio
import multiprocessing
import signal
import threading
from collections import deque
from collections.abc import AsyncIterator
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Self

from mosaic_core.bench.scene import MAX_OBEYED, Obeyed, scene
from mosaic_core.laboratory.joining import configured_with
from mosaic_core.laboratory.memory_server import MemoryServer, MemorySocket
from mosaic_core.runtime.configuration.hook_calls import hook_plugins
from mosaic_core.runtime.robot import Robot

HOST = "127.0.0.1"
LINE_BYTES = 1024 * 1024
_END_S = 5.0


class LineSocket:
    """Sends and reads signaling frames over a stream, a frame a line; a ``TextSocket``."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.close_code: int | None = None
        self._reader = reader
        self._writer = writer

    async def __aiter__(self) -> AsyncIterator[str]:
        while line := await self._reader.readline():
            yield line.decode().rstrip("\n")
        self.close_code = self.close_code or 1006

    async def send(self, text: str) -> None:
        self._writer.write(text.encode() + b"\n")
        await self._writer.drain()

    async def close(self, code: int = 1000, reason: str = "") -> None:
        self.close_code = code
        self._writer.close()
        with suppress(OSError):
            await self._writer.wait_closed()


def run_robot(port: int, pipe: Connection) -> None:
    """Until the pipe closes; each word on it is answered with the commands that came since the last."""
    from mosaic_core.adapters.machine.event_loop import run_event_loop

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # whoever started us ends us
    run_event_loop(_run(port, pipe))


async def _run(port: int, pipe: Connection) -> None:
    obeyed: Obeyed = deque(maxlen=MAX_OBEYED)
    robot = _robot(port, obeyed)
    loop = asyncio.get_running_loop()

    def answer() -> None:
        with suppress(EOFError, OSError):
            while True:
                pipe.recv()
                pipe.send([obeyed.popleft() for _ in range(len(obeyed))])
        with suppress(RuntimeError):  # the loop has ended by itself
            loop.call_soon_threadsafe(robot.stop)

    threading.Thread(target=answer, name="bench-pipe", daemon=True).start()
    await robot.run()


def _robot(port: int, obeyed: Obeyed) -> Robot:
    from mosaic_core.adapters.peers.aiortc_answerer import AiortcAnswerer
    from mosaic_core.adapters.sound.shared_sound import SharedSound
    from mosaic_core.adapters.video.shared_video import SharedVideo

    async def connect(url: str) -> LineSocket:
        return LineSocket(*await asyncio.open_connection(HOST, port, limit=LINE_BYTES))

    plugins = hook_plugins([])
    configured = configured_with(scene(obeyed), plugins=plugins)
    return Robot(
        configured.config,
        configured.connectors,
        shared=configured.shared,
        plugins=plugins,
        connect_socket=connect,
        make_answerer=AiortcAnswerer,
        open_stream=SharedVideo,
        open_sound=SharedSound,
        software="mosaic-core/bench",
    )


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
    """A robot in a process of its own, for the bench. ``with`` runs it. :meth:`take_obeyed` may be called from any one
    thread at a time.
    """

    def __init__(self, port: int) -> None:
        spawn = multiprocessing.get_context("spawn")
        self._pipe, theirs = spawn.Pipe()
        self._process = spawn.Process(target=run_robot, args=(port, theirs), daemon=True)
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
