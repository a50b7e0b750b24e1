"""``mosaic mujoco …``: what a model has, and a robot's file for it. Imports MuJoCo only when a command runs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

app = typer.Typer(add_completion=False, help="Robots that MuJoCo simulates.", no_args_is_help=True)

ModelArgument = Annotated[
    str, typer.Argument(metavar="MODEL", help="Path of a model (MJCF or URDF), or `arm` or `vehicle`.")
]


@app.command("show")
def show(
    model: ModelArgument,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object, for programs.")] = False,
) -> None:
    """List cameras, joints, actuators, sensors, bodies and key frames of a model, as connectors name them."""
    from mosaic_mujoco.cli.listing import print_listing

    print_listing(model, as_json=as_json)


@app.command("init")
def init(
    model: ModelArgument,
    output: Annotated[Path, typer.Argument(help="Where to; - prints it.", allow_dash=True)] = Path(
        "mosaic_config.yaml"
    ),
    force: Annotated[bool, typer.Option("--force", help="Overwrite the file if it exists.")] = False,
) -> None:
    """Write a robot's YAML file with a connector for whatever a model has."""
    from mosaic_mujoco.cli.written import write_robot

    write_robot(model, output, overwrites=force)
