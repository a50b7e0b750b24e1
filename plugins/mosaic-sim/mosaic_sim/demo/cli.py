"""The command ``mosaic demo``: its words. What it does is in :mod:`mosaic_sim.demo.demo_command`, imported then."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(add_completion=False)


@app.command()
def demo(
    port: Annotated[
        int | None, typer.Option(min=0, max=65535, help="Port of the dashboard; default: 9001, or any free one.")
    ] = None,
    no_open: Annotated[bool, typer.Option("--no-open", help="Print the address instead of opening a browser.")] = False,
    headless_check: Annotated[
        bool, typer.Option("--headless-check", help="Drive the robot from Python, say what works, and exit.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON for programs; opens no browser.")] = False,
    arm: Annotated[
        bool, typer.Option("--arm", help="An arm with a gripper instead, simulated by MuJoCo (mosaic-mujoco).")
    ] = False,
    vehicle: Annotated[
        bool, typer.Option("--vehicle", help="A small vehicle instead, simulated by MuJoCo (mosaic-mujoco).")
    ] = False,
    own: Annotated[
        list[Path] | None,
        typer.Option(
            "--with",
            metavar="PATH",
            help="A plugin of your own, which need not be installed: its folder, such as `.`, or one file. "
            "May be given several times.",
        ),
    ] = None,
) -> None:
    """Start a server and a simulated robot on this machine and open the dashboard. Nothing to set up."""
    from mosaic_sim.demo.demo_command import run_demo

    run_demo(
        port,
        opens=not no_open,
        headless_check=headless_check,
        as_json=as_json,
        own=own or (),
        arm=arm,
        vehicle=vehicle,
    )
