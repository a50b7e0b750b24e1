"""``mosaic run``: the composition root. Here, and only here, the robot meets aiortc, websockets and the terminal."""

from __future__ import annotations

import asyncio
import json
import logging
import os
import signal
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from mosaic_core import __version__
from mosaic_core.cli.configuration.local_option import resolver_beside
from mosaic_core.cli.robot.end_signals import SAFE_WITHIN_S, EndSignals
from mosaic_core.cli.robot.lan_serving import LanServing
from mosaic_core.cli.robot.metrics_option import MetricsAddress
from mosaic_core.cli.terminal.error_report import FAILED, FINE
from mosaic_core.cli.terminal.log_output import LogFormat, LogLevel, set_up_logging
from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer, Configured
from mosaic_core.runtime.configuration.config_hints import tell_hints
from mosaic_core.words.config import RobotConfig
from mosaic_core.words.errors import ConfigError, Problem, untold
from mosaic_core.words.lan_wish import LanWish

if TYPE_CHECKING:
    from mosaic_core.runtime.lan.lan_twin import LanTwin
    from mosaic_core.runtime.observation.metrics_server import MetricsServer
    from mosaic_core.runtime.reload.reloader import Reloader
    from mosaic_core.runtime.robot import Robot
    from mosaic_core.runtime.signaling.server_link import KnownServer

logger = logging.getLogger(__name__)

STOP_WITHIN_S = 1.9
"""The robot abandons what ignores stop after 1.5 s; the promise for the whole process is 2 s."""
JSON_PERIOD_S = 1.0
TABLE_PERIOD_S = 0.5


def run_robot(
    path: Path,
    *,
    as_json: bool,
    log_format: LogFormat,
    log_level: LogLevel,
    lan: LanWish | None = None,
    metrics: MetricsAddress | None = None,
    local_connectors: bool | None = None,
    reload: bool = False,
) -> int:
    """Run until a signal; the exit code. Raises :class:`MosaicError` before anything starts. ``reload``: anew
    from its file and code, whenever they change."""
    with_table = not as_json and log_format is LogFormat.TEXT and sys.stdout.isatty()
    if not with_table:
        set_up_logging(log_level, log_format)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(FINE))  # until the event loop takes over
    reloader = _reloader(path, local_connectors) if reload else None
    configured = reloader.configured if reloader is not None else _configured(path, local_connectors)
    serving = _lan_serving(configured.config, lan, path, has_screen=with_table)

    # Only now, so that mistakes in the file are told without waiting for WebRTC and video libraries.
    from mosaic_core.adapters.machine.event_loop import run_event_loop

    if with_table:
        return run_event_loop(_run_with_table(configured, log_level, serving, metrics, reloader))
    show = partial(_print_json, reloader or configured) if as_json else None
    return run_event_loop(_run(configured, show, JSON_PERIOD_S, serving, metrics, reloader))


def _configured(path: Path, local_connectors: bool | None) -> Configured:
    resolver = resolver_beside(path, local_connectors)
    told: Sequence[Problem] = ()
    try:
        return AutoConfigurer(resolver=resolver).from_file(path)
    except ConfigError as error:
        told = error.problems
        raise
    finally:
        for problem in untold(resolver.local.problems, told):
            logger.warning("%s", problem)


def _reloader(path: Path, local_connectors: bool | None) -> Reloader:
    from mosaic_core.runtime.reload.reloader import Reloader

    return Reloader(path, lambda: resolver_beside(path, local_connectors), _tell_mistakes)


def _tell_mistakes(problems: Sequence[Problem]) -> None:
    for problem in problems:
        logger.error("%s", problem, extra={"code": problem.code})
    logger.error("not reloaded: what ran before goes on")


def _lan_serving(config: RobotConfig, wish: LanWish | None, path: Path, *, has_screen: bool) -> LanServing | None:
    if wish is not None:
        robot_id = None if config.server is None else str(config.server.auth.robot_id)
        return LanServing(replace(wish, robot_id=robot_id, has_screen=has_screen))
    if config.server is None:
        cure = "add a server section, or run it for its own network alone: `mosaic run --serve`"
        raise ConfigError([Problem("'server' is missing", file=str(path), path="server", cure=cure)])
    return None


def make_robot(configured: Configured, *, lan: KnownServer | None = None, is_reloaded: bool = False) -> Robot:
    """A robot on the real network. ``lan``: the server that it runs itself. ``is_reloaded``: it may be given cameras
    and microphones later."""
    from mosaic_core.adapters.machine.network_watch import watch_network
    from mosaic_core.adapters.signaling.websocket import open_websocket
    from mosaic_core.cli.robot.transports import loaded_transports
    from mosaic_core.runtime.robot import Robot

    server = configured.config.server
    policy = server.webrtc.ice_transport_policy if server is not None else "all"
    transports = loaded_transports(configured.connectors, relay_only=policy == "relay", for_all=is_reloaded)
    return Robot(
        configured.config,
        configured.connectors,
        shared=configured.shared,
        plugins=configured.plugins,
        connect_socket=open_websocket,
        make_answerer=transports.make_answerer,
        open_stream=transports.open_stream,
        open_sound=transports.open_sound,
        watch_network=watch_network,
        software=f"mosaic-core/{__version__}",
        lan=lan,
    )


async def run_configured(configured: Configured) -> None:
    """Run a robot from Python, as ``mosaic run`` does, until the task is cancelled; its end is orderly then. Ctrl+C in
    ``asyncio.run`` cancels it. Raises :class:`ConfigError` where the configuration names no server, and
    :class:`SignalingError` if the same robot connected elsewhere."""
    if configured.config.server is None:
        raise ConfigError([Problem("'server' is missing", path="server", cure="add a server section")])
    await make_robot(configured).run()


async def _run_with_table(
    configured: Configured,
    log_level: LogLevel,
    serving: LanServing | None,
    metrics: MetricsAddress | None,
    reloader: Reloader | None,
) -> int:
    from rich.console import Console, Group
    from rich.live import Live
    from rich.text import Text

    from mosaic_core.cli.robot.live_table import robot_table

    console = Console()
    set_up_logging(log_level, console=console)
    with Live(console=console, auto_refresh=False) as live:

        def show(robot: Robot) -> None:
            above = serving.shown(console.height) if serving is not None else ""
            live.update(
                Group(*([Text.from_ansi(above)] if above else []), robot_table(robot.snapshot(), console.width)),
                refresh=True,
            )

        return await _run(configured, show, TABLE_PERIOD_S, serving, metrics, reloader)


def _print_json(configured: Configured | Reloader, robot: Robot) -> None:
    hints = [asdict(one) for one in (configured if isinstance(configured, Configured) else configured.configured).hints]
    typer.echo(json.dumps({**asdict(robot.snapshot()), "hints": hints}, default=str))


async def _run(
    configured: Configured,
    show: Callable[[Robot], None] | None,
    period_s: float,
    serving: LanServing | None,
    metrics: MetricsAddress | None,
    reloader: Reloader | None,
) -> int:
    from mosaic_core.adapters.machine.event_loop import keep_what_is_loaded

    tell_hints(configured.hints)
    stop_wanted = asyncio.Event()
    twin = serving.twin() if serving is not None else None
    lan = serving.known(twin) if serving is not None and twin is not None else None
    robot = make_robot(configured, lan=lan, is_reloaded=reloader is not None)
    signals = EndSignals(stop_wanted, lambda: robot.make_safe("safety.shutdown", SAFE_WITHIN_S))
    signals.install()
    page = await _metrics_page(robot, metrics)
    keep_what_is_loaded()
    running = asyncio.create_task(robot.run(), name="mosaic-robot")
    stopping = asyncio.create_task(stop_wanted.wait(), name="mosaic-signal")
    beside = [asyncio.create_task(_keep_showing(robot, show, period_s), name="mosaic-display")] if show else []
    if reloader is not None:
        beside.append(asyncio.create_task(reloader.run(robot), name="mosaic-reload"))
    if serving is not None and twin is not None:
        serving.on_news(robot.near_changed)
        beside.append(asyncio.create_task(twin.run(), name="mosaic-lan-twin"))
    try:
        await asyncio.wait({running, stopping}, return_when=asyncio.FIRST_COMPLETED)
        await _ended(robot, running, twin)
        signals.done()
        running.result()
        return FINE
    finally:
        for task in (stopping, *beside):
            task.cancel()
        if page is not None:
            page.close()


async def _metrics_page(robot: Robot, address: MetricsAddress | None) -> MetricsServer | None:
    """The page, open; raises :class:`MosaicError` where it can't be."""
    if address is None:
        return None
    from mosaic_core.runtime.observation.metrics_server import MetricsServer
    from mosaic_core.runtime.observation.metrics_text import metrics_text

    software = f"mosaic-core/{__version__}"
    page = MetricsServer(address.host, address.port, lambda: metrics_text(robot.snapshot(), software))
    await page.open()
    logger.info("metrics at %s", page.url)
    return page


async def _ended(robot: Robot, running: asyncio.Task[None], twin: LanTwin | None) -> None:
    """Robot and server end side by side; what takes longer than we promised is ended for them."""
    deadline_s = time.monotonic() + STOP_WITHIN_S
    robot.stop()
    if twin is not None:
        twin.ask_to_end()
    await asyncio.wait({running}, timeout=STOP_WITHIN_S)
    if twin is not None:
        await asyncio.to_thread(twin.end, deadline_s)
    if not running.done():
        # Waiting for what hangs in a thread would take longer than we promised.
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(FAILED)


async def _keep_showing(robot: Robot, show: Callable[[Robot], None], period_s: float) -> None:
    while True:
        show(robot)
        await asyncio.sleep(period_s)
