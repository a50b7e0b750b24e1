"""``mosaic run``: its words. What it does is in :mod:`mosaic_core.cli.robot.run_command`, imported when it does it."""

from __future__ import annotations

import itertools
import re
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from mosaic_core.cli.configuration.local_option import LocalOption
from mosaic_core.cli.robot.metrics_option import metrics_address
from mosaic_core.cli.terminal.log_output import LogFormat, LogLevel
from mosaic_core.words.errors import MosaicError
from mosaic_core.words.lan_wish import DEFAULT_ADDRESS, DEFAULT_PORT, LanWish

OPTION = "--serve"
_ADDRESS = re.compile(r"\d+|\[[0-9A-Fa-f:.%\w]+\](:\d+)?|[^\s/\\:]+:\d+|\d+(\.\d+){3}|localhost")


class CommandWithServe(TyperCommand):
    """Puts the default where no address follows, so that the parser sees an option like any other."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        return super().parse_args(ctx, with_address(args))


def with_address(arguments: list[str]) -> list[str]:
    """``--serve`` without a value becomes ``--serve=<default>``. Of two words that follow the second is the file."""
    whole: list[str] = []
    for index, one in enumerate(arguments):
        words = [*itertools.takewhile(lambda word: not word.startswith("-"), arguments[index + 1 : index + 3])]
        has_address = len(words) == 2 or any(map(_ADDRESS.fullmatch, words))
        whole.append(f"{OPTION}={DEFAULT_ADDRESS}" if one == OPTION and not has_address else one)
    return whole


def wish_of(
    serve: str | None, name: str, certificate: Path | None, key: Path | None, *, widgets: bool = True
) -> LanWish | None:
    """What the options together ask for. Raises :class:`MosaicError` (``config.lan``)."""
    if (certificate is None) != (key is None):
        raise MosaicError("--tls-cert and --tls-key go together", code="config.lan", cure="give both, or neither")
    if serve is None:
        if certificate is not None or name or not widgets:
            raise MosaicError(
                "--name, --tls-cert, --tls-key and --no-widgets need --serve", code="config.lan", cure="add --serve"
            )
        return None
    host, port = address_of(serve)
    return LanWish(host, port, name=name, tls_certificate=certificate, tls_key=key, serves_widgets=widgets)


def address_of(text: str) -> tuple[str, int]:
    """``HOST``, ``PORT``, ``HOST:PORT`` or ``[IPv6]:PORT``. Raises :class:`MosaicError` (``config.lan``)."""
    host, separator, port = text.rpartition(":")
    if text.isdecimal():
        host, port = DEFAULT_ADDRESS.rpartition(":")[0], text
    elif not separator or text.endswith("]"):
        host, port = text, str(DEFAULT_PORT)
    if not host or not _ADDRESS.fullmatch(f"{host}:{port}") or not 0 < int(port) <= 65535:
        cure = f"write for example {DEFAULT_ADDRESS}"
        raise MosaicError(f"--serve: {text!r} is no HOST:PORT", code="config.lan", cure=cure)
    return host.strip("[]"), int(port)


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
    widgets: Annotated[
        bool, typer.Option("--widgets/--no-widgets", help="With --serve: serve the widgets of installed plugins.")
    ] = True,
    metrics: Annotated[
        str | None,
        typer.Option(metavar="HOST:PORT", help="Serve Prometheus metrics there, for example on 127.0.0.1:9464."),
    ] = None,
    metrics_public: Annotated[
        bool, typer.Option("--metrics-public", help="Serve them to others than this machine, too; nothing guards them.")
    ] = False,
    reload: Annotated[
        bool,
        typer.Option(
            "--reload", help="Watch the file and the code of its connectors; begin those anew that change. No service."
        ),
    ] = False,
    local_connectors: LocalOption = None,
    log_format: Annotated[LogFormat, typer.Option(help="How log lines look on stderr.")] = LogFormat.TEXT,
    log_level: Annotated[LogLevel, typer.Option(help="The least severe lines to show.")] = LogLevel.INFO,
) -> None:
    """Run a robot: connect its connectors to operators until Ctrl+C (SIGINT) or SIGTERM.

    It ends with exit code 3 where another robot of the same id took its place at the server.
    """
    from mosaic_core.cli.robot.run_command import run_robot

    lan = wish_of(serve, name, tls_cert, tls_key, widgets=widgets)
    address = metrics_address(metrics, is_public=metrics_public) if metrics is not None else None
    code = run_robot(
        config,
        as_json=json_lines,
        log_format=log_format,
        log_level=log_level,
        lan=lan,
        metrics=address,
        local_connectors=local_connectors,
        reload=reload,
    )
    raise typer.Exit(code)
