"""``mosaic run``: the composition root. Here, and only here, the robot meets aiortc, websockets and the terminal."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import sys
from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from mosaic_core import __version__
from mosaic_core.cli.error_report import FAILED, FINE
from mosaic_core.cli.log_output import LogFormat, LogLevel, set_up_logging
from mosaic_core.runtime.auto_configurer import AutoConfigurer, Configured

if TYPE_CHECKING:
    from mosaic_core.runtime.robot import Robot

STOP_WITHIN_S = 1.9
"""The robot abandons what ignores stop after 1.5 s; the promise for the whole process is 2 s."""
JSON_PERIOD_S = 1.0
TABLE_PERIOD_S = 0.5


def run_robot(path: Path, *, as_json: bool, log_format: LogFormat, log_level: LogLevel) -> int:
    """Run until a signal; the exit code. Raises :class:`ConfigError` before anything starts."""
    with_table = not as_json and log_format is LogFormat.TEXT and sys.stdout.isatty()
    if not with_table:
        set_up_logging(log_level, log_format)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(FINE))  # until the event loop takes over
    configured = AutoConfigurer().from_file(path)

    # Only now, so that mistakes in the file are told without waiting for WebRTC and video libraries.
    from mosaic_core.adapters.event_loop import run_event_loop

    if with_table:
        return run_event_loop(_run_with_table(configured, log_level))
    return run_event_loop(_run(configured, _print_json if as_json else None, JSON_PERIOD_S))


def make_robot(configured: Configured) -> Robot:
    """A robot on the real network."""
    from mosaic_core.adapters.aiortc_answerer import aiortc_answerer
    from mosaic_core.adapters.shared_sound import SharedSound
    from mosaic_core.adapters.shared_video import SharedVideo
    from mosaic_core.adapters.websocket import open_websocket
    from mosaic_core.runtime.robot import Robot

    policy = configured.config.server.webrtc.ice_transport_policy
    return Robot(
        configured.config,
        configured.connectors,
        shared=configured.shared,
        plugins=configured.plugins,
        connect_socket=open_websocket,
        make_answerer=partial(aiortc_answerer, relay_only=policy == "relay"),
        open_stream=SharedVideo,
        open_sound=SharedSound,
        software=f"mosaic-core/{__version__}",
    )


async def _run_with_table(configured: Configured, log_level: LogLevel) -> int:
    from rich.console import Console
    from rich.live import Live

    from mosaic_core.cli.live_table import robot_table

    console = Console()
    set_up_logging(log_level, console=console)
    with Live(console=console, auto_refresh=False) as live:
        server = configured.config.server.ws_url

        def show(robot: Robot) -> None:
            live.update(robot_table(robot.snapshot(), server), refresh=True)

        return await _run(configured, show, TABLE_PERIOD_S)


def _print_json(robot: Robot) -> None:
    typer.echo(json.dumps(asdict(robot.snapshot()), default=str))


async def _run(configured: Configured, show: Callable[[Robot], None] | None, period_s: float) -> int:
    robot = make_robot(configured)
    stop_wanted = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stop_wanted.set)
    running = asyncio.create_task(robot.run(), name="mosaic-robot")
    stopping = asyncio.create_task(stop_wanted.wait(), name="mosaic-signal")
    showing = asyncio.create_task(_keep_showing(robot, show, period_s), name="mosaic-display") if show else None
    try:
        await asyncio.wait({running, stopping}, return_when=asyncio.FIRST_COMPLETED)
        if not running.done():
            robot.stop()
            await asyncio.wait({running}, timeout=STOP_WITHIN_S)
        if not running.done():
            # Waiting for what hangs in a thread would take longer than we promised.
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(FAILED)
        running.result()
        return FINE
    finally:
        stopping.cancel()
        if showing is not None:
            showing.cancel()


async def _keep_showing(robot: Robot, show: Callable[[Robot], None], period_s: float) -> None:
    while True:
        show(robot)
        await asyncio.sleep(period_s)
