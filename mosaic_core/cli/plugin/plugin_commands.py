"""``mosaic plugin``: begins a plugin of your own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mosaic_core.cli.terminal.error_report import usage

app = typer.Typer(add_completion=False, no_args_is_help=True, help="Plugins of your own.")


@app.callback()
def plugins() -> None:
    """Plugins of your own."""


@app.command()
def new(
    name: Annotated[str, typer.Argument(help="The distribution's name, such as acme-thermometer; also the folder's.")],
    sensor: Annotated[bool, typer.Option("--sensor", help="It sends what it measures.")] = False,
    actuator: Annotated[bool, typer.Option("--actuator", help="It moves, and stops when nobody commands it.")] = False,
    camera: Annotated[bool, typer.Option("--camera", help="It shows pictures.")] = False,
    request: Annotated[bool, typer.Option("--request", help="It answers questions, and tells how far it is.")] = False,
    full: Annotated[
        bool, typer.Option("--full", help="It sends, moves and answers: three connectors of one device, and a widget.")
    ] = False,
) -> None:
    """Write the package of a new plugin into a folder of its name: connectors with a device that is made up, their
    tests, a README and a workflow that checks all of it. It works from the first second."""
    wanted = {"sensor": sensor, "actuator": actuator, "camera": camera, "request": request, "full": full}
    kinds = [kind for kind, is_wanted in wanted.items() if is_wanted]
    if len(kinds) != 1:
        usage(f"say one of {', '.join(f'--{kind}' for kind in wanted)}")
    from mosaic_core.cli.plugin.scaffold import NewPlugin
    from mosaic_core.runtime.configuration.resolver import ConnectorResolver

    plugin = NewPlugin(name, kinds[0])
    taken = [one for one in ConnectorResolver().types() if one.type in plugin.connector_types]
    if taken:
        usage(f"{taken[0].source} has the type '{taken[0].type}' already; choose another name")
    plugin.write(Path(name))
    typer.echo(f"wrote {name}/; next:\n  cd {name} && pip install --group dev -e .")
    typer.echo("  pytest\n  mosaic validate --allow-missing-env\n  mosaic demo --with .")
