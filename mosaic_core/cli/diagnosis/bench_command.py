"""``mosaic bench``: what this machine's MOSAIC is worth on networks that operators really have."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Annotated

import typer

from mosaic_core.cli.terminal.error_report import FAILED, FINE, need_known
from mosaic_core.machines.laboratory.impaired_link import PROFILES
from mosaic_core.machines.laboratory.nat import NAT_KINDS, NatKind


def bench(
    profile: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help=f"A network: {', '.join(PROFILES)}. May be given more than once."),
    ] = None,
    every: Annotated[bool, typer.Option("--all", help="Every network, which is also what naming none means.")] = False,
    seconds: Annotated[float, typer.Option(min=1, max=3600, help="How long each is measured.")] = 10.0,
    nat: Annotated[
        str | None, typer.Option(metavar="KIND", help=f"Both sides behind a NAT: {', '.join(NAT_KINDS)}.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object per network.")] = False,
    markdown: Annotated[bool, typer.Option("--markdown", help="The table in Markdown, for a document.")] = False,
) -> None:
    """Measure a robot and an operator over bad networks: commands, pictures, freezes, recovery, set-up.

    A robot with a camera and a receiver of commands, in a process of its own, and a Python operator, over real WebRTC
    through a path in user space that delays, loses and throttles its packets. Needs no root, no server, no camera.
    Exit code 1 if a network could not be crossed.
    """
    names = list(PROFILES) if every or not profile else list(dict.fromkeys(profile))
    for name in names:
        need_known("network", name, list(PROFILES))
    if nat is not None:
        need_known("NAT", nat, NAT_KINDS)
    kind: NatKind | None = next((one for one in NAT_KINDS if one == nat), None)
    raise typer.Exit(_run(names, seconds, kind, as_json=as_json, markdown=markdown))


def _run(names: list[str], seconds: float, nat: NatKind | None, *, as_json: bool, markdown: bool) -> int:
    from rich.console import Console

    from mosaic_core.adapters.machine.event_loop import run_event_loop
    from mosaic_core.bench.figures import Figures
    from mosaic_core.bench.profile_run import measured
    from mosaic_core.bench.table import markdown_table, rich_table
    from mosaic_core.cli.terminal.log_output import LogLevel, set_up_logging
    from mosaic_core.cli.terminal.rich_table import PIPE_WIDTH, console

    set_up_logging(LogLevel.ERROR)
    rows: list[Figures] = []
    with Console(stderr=True).status("") as status:
        for number, name in enumerate(names, 1):

            def tell(doing: str, where: str = f"{name} ({number} of {len(names)})") -> None:
                status.update(f"{where}: {doing} …")

            rows.append(run_event_loop(measured(PROFILES[name], seconds, nat, tell)))
            if as_json:
                typer.echo(json.dumps(asdict(rows[-1])))
    if markdown:
        typer.echo(markdown_table(rows))
    elif not as_json:
        console(PIPE_WIDTH).print(rich_table(rows))
    return FAILED if any(row.failure for row in rows) else FINE
