"""``mosaic plugin``: begins a plugin of your own, and judges any."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from mosaic_core.cli.terminal.error_report import usage

app = typer.Typer(add_completion=False, no_args_is_help=True, help="Plugins of your own.")


class WantedLevel(StrEnum):
    """The rungs of the quality ladder, as words of the command line."""

    BRONZE = "bronze"
    SILVER = "silver"
    GOLD = "gold"


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
    typer.echo(f"wrote {name}/; next:\n  cd {name} && pip install --upgrade pip && pip install --group dev -e .")
    typer.echo(f"  # its types in a robot's file: {', '.join(plugin.connector_types)}")
    typer.echo("  pytest\n  mosaic validate --allow-missing-env\n  mosaic demo --with .")


@app.command()
def check(
    plugins: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="DISTRIBUTION|FOLDER|TYPE",
            help="What to examine; without a word the plugin of this folder, else everything that is installed.",
            show_default=False,
        ),
    ] = None,
    level: Annotated[WantedLevel, typer.Option(help="How far up to look.")] = WantedLevel.BRONZE,
    restarts: Annotated[int, typer.Option(min=2, help="How often `leaves-nothing` restarts a connector.")] = 100,
    traceback: Annotated[
        bool, typer.Option("--traceback", help="Every error with its traceback, not only those of imports.")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object per line.")] = False,
) -> None:
    """Does a plugin keep what people expect of it? Bronze, silver and gold are rules that this command checks, each
    with the line that breaks it, why it matters, and the cure.

    It runs the plugin's code in this process, with the params of its `trial` or else of its example: have no device
    connected that must not move. Exit code 0 if every plugin reaches the level, 1 if not; what can't be judged, such as
    tests where only a wheel is installed, is not reached.
    """
    from mosaic_core.cli.plugin.check_command import check_plugins

    asked = plugins or []
    code = check_plugins(asked, level.value, as_json=as_json, with_traces=traceback, restarts=restarts)
    raise typer.Exit(code)
