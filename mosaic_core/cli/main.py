"""The command ``mosaic``. Each command imports what it needs when it runs, so that all of them start fast."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import typer

from mosaic_core import __version__
from mosaic_core.cli.configuration import config_commands, connectors_commands
from mosaic_core.cli.diagnosis import bench_command, doctor_commands, safety_commands
from mosaic_core.cli.operator import control_commands
from mosaic_core.cli.plugin_commands import GroupWithPlugins
from mosaic_core.cli.robot.metrics_option import metrics_address
from mosaic_core.cli.robot.serve_option import CommandWithServe, wish_of
from mosaic_core.cli.terminal.error_report import FAILED, FINE, USAGE, as_json, exit_code_of, report, report_problems
from mosaic_core.cli.terminal.log_output import LogFormat, LogLevel
from mosaic_core.words.errors import ConfigError, MosaicError, Problem
from mosaic_core.words.lan import DEFAULT_ADDRESS

DEFAULT_CONFIG = Path("mosaic_config.yaml")

app = typer.Typer(
    cls=GroupWithPlugins,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="MOSAIC: robots and operators, connected peer to peer.",
)
app.add_typer(connectors_commands.app, name="connectors")
app.add_typer(config_commands.app, name="config")
app.add_typer(control_commands.app, name="operator")
app.add_typer(safety_commands.app, name="safety")
app.add_typer(doctor_commands.app, name="doctor")
app.command()(bench_command.bench)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"mosaic-core {__version__}")
        raise typer.Exit


@app.callback()
def mosaic(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """MOSAIC: robots and operators, connected peer to peer."""


@app.command(cls=CommandWithServe)
def run(
    config: Annotated[Path, typer.Argument(help="The robot's YAML file.")] = DEFAULT_CONFIG,
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
    """Run a robot: connect its connectors to operators until SIGINT (Ctrl+C) or SIGTERM."""
    from mosaic_core.cli.robot.run_command import run_robot

    lan = wish_of(serve, name, tls_cert, tls_key)
    address = metrics_address(metrics, is_public=metrics_public) if metrics is not None else None
    code = run_robot(config, as_json=json_lines, log_format=log_format, log_level=log_level, lan=lan, metrics=address)
    raise typer.Exit(code)


@app.command()
def validate(
    config: Annotated[Path, typer.Argument(help="The robot's YAML file.")] = DEFAULT_CONFIG,
    as_json_text: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
    allow_missing_env: Annotated[
        bool, typer.Option(help="Forgive environment variables and secret files that only exist on the robot.")
    ] = False,
) -> None:
    """Check a robot's YAML file: every mistake at once. Starts nothing and opens no device."""
    from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer
    from mosaic_core.runtime.configuration.config_loader import validate_file

    leases: Mapping[str, Sequence[str]] = {}
    try:
        validation = validate_file(config, allow_missing_env=allow_missing_env)
        rehearsal = AutoConfigurer().rehearse(validation)
        problems = _by_line((*validation.problems, *rehearsal.problems))
        hints, leases = _by_line((*validation.hints, *rehearsal.hints)), rehearsal.leases
    except ConfigError as error:
        problems, hints = error.problems, ()
    if as_json_text:
        found = {"problems": as_json(problems), "hints": as_json(hints), "leases": leases}
        typer.echo(json.dumps({"valid": not problems, **found}))
    else:
        report_problems(hints, as_hints=True)
        for resource, labels in leases.items() if len(leases) > 1 else ():
            typer.echo(f"lease '{resource}': {', '.join(labels)}")
        if problems:
            report_problems(problems)
        else:
            typer.echo(f"{config}: valid")
    raise typer.Exit(USAGE if problems else FINE)


def _by_line(problems: Sequence[Problem]) -> tuple[Problem, ...]:
    return tuple(sorted(problems, key=lambda one: one.line or 0))


def main(arguments: Sequence[str] | None = None) -> None:
    """The console script: runs a command and exits."""
    try:
        app(args=arguments, prog_name="mosaic")
    except MosaicError as error:
        report(error)
        sys.exit(exit_code_of(error))
    except BrokenPipeError:
        # Whoever read our output (`| head`) has enough; Python would complain again while it closes stdout.
        sys.stderr.close()
        sys.exit(FAILED)


if __name__ == "__main__":
    main()
