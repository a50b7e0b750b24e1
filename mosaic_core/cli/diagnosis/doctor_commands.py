"""``mosaic doctor``: what works on this machine, how fast, and what is missing."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from mosaic_core.cli.configuration.local_option import HERE, LocalOption, resolver_beside
from mosaic_core.cli.terminal.error_report import usage

if TYPE_CHECKING:
    from mosaic_core.adapters.video.encoder_choice import EncoderSpeed, Probe


class DoctorGroup(TyperGroup):
    """The commands ``mosaic doctor FILE`` and ``mosaic doctor encoders``: the first word decides."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        ctx.meta[_NAMES_COMMAND] = bool(args) and args[0] in self.commands
        ctx.allow_interspersed_args = not ctx.meta[_NAMES_COMMAND]
        return super().parse_args(ctx, args)

    def get_params(self, ctx: Any) -> list[Any]:
        params = super().get_params(ctx)
        return [one for one in params if one.name != "config"] if ctx.meta.get(_NAMES_COMMAND) else params


_NAMES_COMMAND = "mosaic.doctor.names_command"
app = typer.Typer(
    cls=DoctorGroup,
    add_completion=False,
    invoke_without_command=True,
    help="What works, what does not, and what to do.",
)

WIDTH, HEIGHT = 1280, 720


@app.callback()
def doctor(
    context: typer.Context,
    config: Annotated[
        Path | None,
        typer.Argument(
            help=f"The robot's YAML file; without a word {HERE}, if it is there. Without one less can be checked."
        ),
    ] = None,
    server: Annotated[str, typer.Option(help="A server's address, in place of the file's.")] = "",
    only: Annotated[
        list[str] | None, typer.Option("--only", metavar="GROUP", help="Only this group of checks; may be repeated.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
    with_server: Annotated[
        bool,
        typer.Option(
            "--with-server",
            help="Also make a whole connection as an operator, through the server, and measure it: that takes the way "
            "to the robot for two seconds.",
        ),
    ] = False,
    email: Annotated[str, typer.Option(envvar="MOSAIC_EMAIL", help="The account for --with-server.")] = "",
    code: Annotated[
        str, typer.Option(help="As for `mosaic operator`: a one-time sign-in code instead of account and password.")
    ] = "",
    local_connectors: LocalOption = None,
) -> None:
    """What works, what does not, and what to do: machine, plugins, server, STUN, TURN, NAT, WebRTC, encoders, devices.

    Takes 20 seconds at most, changes nothing, and disturbs no running robot. Exit code 1 if something failed.
    Groups: config, code, machine, install, network, server, ice, webrtc, relay, video, device, whole, and those of
    plugins.
    """
    if context.invoked_subcommand is None:
        from mosaic_core.cli.diagnosis.doctor_examination import OperatorAccount, examine

        account = OperatorAccount(email, code) if with_server else None
        config = config or (HERE if HERE.is_file() else None)
        if config is None and local_connectors is not None:
            word = "--local-connectors" if local_connectors else "--no-local-connectors"
            usage(f"{word} is about code beside the robot's YAML file, and there is no {HERE} here")
        resolver = None if config is None else resolver_beside(config, local_connectors)
        raise typer.Exit(examine(config, server, only or [], as_json=as_json, account=account, resolver=resolver))


@app.command()
def encoders(as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False) -> None:
    """Try every video encoder: which ones work, how fast they are at 720p, and why the others don't."""
    from mosaic_core.adapters.video.encoder_choice import KINDS, measured_speed, probed
    from mosaic_core.doctor.board_checks import ROOT, board_model
    from mosaic_core.doctor.encoder_checks import found_encoders, taken_sentence
    from mosaic_core.machines.diagnosis.board_verdicts import Board

    found = found_encoders()
    chosen = {kind.name for kind in found.values()}
    rows = []
    for kind in KINDS:
        probe = probed(kind)
        rows.append((probe, measured_speed(kind, WIDTH, HEIGHT) if probe.works else None, kind.name in chosen))
    if as_json:
        typer.echo(json.dumps([_as_json(*row) for row in rows]))
    else:
        _print_table(rows)
        if found:
            typer.echo(f"\n{taken_sentence(found, Board(board_model(ROOT)))}")
    if not chosen:
        raise typer.Exit(1)


def _as_json(probe: Probe, speed: EncoderSpeed | None, is_chosen: bool) -> dict[str, Any]:
    return {
        "encoder": probe.kind.name,
        "codec": probe.kind.codec,
        "hardware": probe.kind.is_hardware,
        "works": probe.works,
        "chosen": is_chosen,
        "problem": probe.problem or None,
        "width": WIDTH,
        "height": HEIGHT,
        **(asdict(speed) if speed is not None else {"fps": None, "median_ms": None, "slow_ms": None}),
    }


def _print_table(rows: list[tuple[Probe, EncoderSpeed | None, bool]]) -> None:
    from rich.table import Table

    from mosaic_core.cli.terminal.rich_table import PIPE_WIDTH, console

    table = Table("codec", "encoder", "in", f"fps at {HEIGHT}p", "ms per picture", "90 % below", "used", box=None)
    for column in (3, 4, 5):
        table.columns[column].justify = "right"
    missing = Table("encoder", "why it does not work here", box=None)
    for probe, speed, is_chosen in rows:
        kind = probe.kind
        if speed is None:
            missing.add_row(kind.name, probe.problem)
            continue
        figures = (f"{speed.fps:.0f}", f"{speed.median_ms:.1f}", f"{speed.slow_ms:.1f}")
        table.add_row(
            kind.codec, kind.name, "hardware" if kind.is_hardware else "software", *figures, "yes" if is_chosen else ""
        )
    out = console(PIPE_WIDTH)
    out.print(table)
    if missing.row_count:
        out.print()
        out.print(missing)
