"""Runs ``mosaic demo``: a server and a simulated robot until Ctrl+C, and a browser at the robot's page."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path
from typing import NoReturn

import typer
from rich.console import Console

from mosaic_sim.demo import browser
from mosaic_sim.demo.demo_robot import chosen_robot
from mosaic_sim.demo.errors import DemoFailed
from mosaic_sim.demo.greeting import greet, report_failure
from mosaic_sim.demo.headless_check import checked, print_results
from mosaic_sim.demo.own_plugin import plugin_at
from mosaic_sim.demo.supervisor import WATCH_S, Interrupted, RunningDemo, endings_interrupt, running_demo


def run_demo(
    port: int | None,
    *,
    opens: bool,
    headless_check: bool,
    as_json: bool,
    own: Sequence[Path] = (),
    arm: bool = False,
    vehicle: bool = False,
) -> None:
    """Server, robot and page until Ctrl+C; ``own``: where plugins stand whose connectors the robot shall have, too.
    Raises :class:`typer.Exit` with the exit code."""
    try:
        with endings_interrupt(), ExitStack() as stack:
            if not as_json:
                typer.echo("Starting a server and a simulated robot …")
            plugins = [plugin_at(path) for path in {path.resolve(): path for path in own}.values()]
            shown = chosen_robot(arm=arm, vehicle=vehicle)
            running = stack.enter_context(running_demo(port, plugins, shown, on_trial=headless_check))
            if headless_check:
                raise typer.Exit(_check(running, as_json))
            _present(running, opens=opens, as_json=as_json)
            _watch(running, shows_log=bool(own))
    except Interrupted:
        if headless_check:
            typer.echo("interrupted: nothing was checked to its end", err=True)
        raise typer.Exit(130 if headless_check else 0) from None
    except DemoFailed as failure:
        if as_json:
            typer.echo(json.dumps({"ok": False, "error": failure.message, "cure": failure.cure}))
        report_failure(Console(stderr=True), failure)
        raise typer.Exit(1) from None


def _check(running: RunningDemo, as_json: bool) -> int:
    """The exit code."""
    results = checked(running)
    is_ok = all(result.is_ok for result in results)
    if as_json:
        typer.echo(json.dumps({"ok": is_ok, "checks": [result.wire() for result in results]}))
    else:
        print_results(Console(), results)
        for note in running.notes:
            typer.echo(f"note: {note}")
    return 0 if is_ok else 1


def _present(running: RunningDemo, *, opens: bool, as_json: bool) -> None:
    """Open the browser signed in, or say how to sign in. The code is shown only where no browser took it."""
    code, expires_at = running.server.one_time_code()
    page = running.robot_page(code)
    if as_json:
        seed = running.seed
        facts = {"url": running.url, "page": page, "pageExpiresAt": expires_at.isoformat(timespec="seconds")}
        account = {"email": seed.email, "password": seed.password}
        pids = {"server": running.server.child.pid, "robot": running.robot.pid}
        brought = [asdict(one) for one in running.own]
        typer.echo(
            json.dumps({"ok": True, **facts, **account, "robotId": seed.robot_id, "pids": pids, "with": brought})
        )
        return
    is_opened = opens and browser.opened(page)
    greet(Console(), running, running.robot_page() if is_opened else page, is_opened=is_opened)


def _watch(running: RunningDemo, *, shows_log: bool) -> NoReturn:
    """Until a child dies, which raises, or a signal ends the demo. Whoever has brought code sees what the robot says of
    it."""
    while True:
        running.check_alive()
        for line in running.robot.new_lines() if shows_log else ():
            typer.echo(f"robot: {line}", err=True)
        time.sleep(WATCH_S)
