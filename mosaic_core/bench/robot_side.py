"""The other process: a robot until whoever started it ends. WebRTC is imported when it runs."""

from __future__ import annotations

import asyncio
import signal
import threading
from collections import deque
from contextlib import suppress
from multiprocessing.connection import Connection

from mosaic_core.bench.line_socket import LINE_BYTES, LineSocket
from mosaic_core.bench.scene import MAX_OBEYED, Obeyed, scene
from mosaic_core.laboratory.joining import checked_config
from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer
from mosaic_core.runtime.configuration.hook_calls import hook_plugins
from mosaic_core.runtime.configuration.resolver import ConnectorResolver
from mosaic_core.runtime.robot import Robot


def run_robot(host: str, port: int, pipe: Connection) -> None:
    """Until the pipe closes; each word on it is answered with the commands that came since the last."""
    from mosaic_core.adapters.machine.event_loop import run_event_loop

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # whoever started us ends us
    run_event_loop(_run(host, port, pipe))


async def _run(host: str, port: int, pipe: Connection) -> None:
    obeyed: Obeyed = deque(maxlen=MAX_OBEYED)
    robot = _robot(host, port, obeyed)
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


def _robot(host: str, port: int, obeyed: Obeyed) -> Robot:
    from mosaic_core.adapters.peers.aiortc_answerer import AiortcAnswerer
    from mosaic_core.adapters.sound.shared_sound import SharedSound
    from mosaic_core.adapters.video.shared_video import SharedVideo

    async def connect(url: str) -> LineSocket:
        return LineSocket(*await asyncio.open_connection(host, port, limit=LINE_BYTES))

    plugins = hook_plugins([])
    configured = AutoConfigurer(resolver=ConnectorResolver([]), plugins=plugins).configure(
        checked_config(scene(obeyed))
    )
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
