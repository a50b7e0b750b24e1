"""``mosaic run``: its words. What it does is in :mod:`mosaic_core.cli.robot.run_command`, imported when it does it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mosaic_core.cli.robot.metrics_option import metrics_address
from mosaic_core.cli.robot.serve_option import CommandWithServe, wish_of
from mosaic_core.cli.terminal.log_output import LogFormat, LogLevel
from mosaic_core.words.lan import DEFAULT_ADDRESS

app = typer.Typer(add_completion=False)


@app.command(cls=CommandWithServe)
def run(
    config: Annotated[Path, typer.Argument(help="The robot's YAML file.")] = Path("mosaic_config.yaml"),
    json_lines: Annotated[bool, typer.Option("--json", help="A JSON object per second instead of the table.")] = False,
    serve: Annotated[
        str | None,
        typer.Option(
            metavar="[HOST:PORT]",
            help=f"Serve the dashboard to this network, too; without an address on {DEFAULT_ADDRESS}.",
        ),
    ] = None,
    name: Annotated[str, typer.Option(help="What the robot is called on this network; default: the host's name.")] = "",
    tls_cert: Annotated[
        Path | None, typer.Option(exists=True, dir_okay=False, help="Certificate for --serve: https instead of http.")
    ] = None,
    tls_key: Annotated[Path | None, typer.Option(exists=True, dir_okay=False, help="Its private key.")] = None,
    metrics: Annotated[
        str | None,
        typer.Option(metavar="HOST:PORT", help="Serve Prometheus metrics there, for example on 127.0.0.1:9464."),
    ] = None,
    metrics_public: Annotated[
        bool, typer.Option("--metrics-public", help="Serve them to others than this machine, too; nothing guards them.")
    ] = False,
    log_format: Annotated[LogFormat, typer.Option(help="How log lines look on stderr.")] = LogFormat.TEXT,
    log_level: Annotated[LogLevel, typer.Option(help="The least severe lines to show.")] = LogLevel.INFO,
) -> None:
    """Run a robot: connect its connectors to operators until Ctrl+C (SIGINT) or SIGTERM."""
    from mosaic_core.cli.robot.run_command import run_robot

    lan = wish_of(serve, name, tls_cert, tls_key)
    address = metrics_address(metrics, is_public=metrics_public) if metrics is not None else None
    code = run_robot(config, as_json=json_lines, log_format=log_format, log_level=log_level, lan=lan, metrics=address)
    raise typer.Exit(code)
