"""``mosaic safety``: whether a configuration keeps its promises when an operator doesn't."""

from __future__ import annotations

import json
from collections.abc import Callable, Coroutine
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mosaic_core.cli.configuration.local_option import LocalOption, resolver_beside
from mosaic_core.cli.terminal.error_report import FAILED, FINE, need_known, usage

if TYPE_CHECKING:
    from rich.console import Console

    from mosaic_core.drill.findings import DrillFinding
    from mosaic_core.drill.rig import Rig
    from mosaic_core.runtime.configuration.auto_configurer import Configured

app = typer.Typer(add_completion=False, no_args_is_help=True, help="Exercise what keeps a robot safe.")

_TABLE_WIDTH = 110
"""On a narrower terminal the reasons stand below the table."""
_WHOLE = ("what", "connector", "gate", "")
"""Columns that are never wrapped: who reads must always see what was exercised, of which connector."""
_STYLES = {"passed": "green", "failed": "bold red", "skipped": "dim"}


@app.callback()
def safety() -> None:
    """Exercise what keeps a robot safe."""


@app.command()
def drill(
    config: Annotated[Path, typer.Argument(help="The robot's YAML file.")] = Path("mosaic_config.yaml"),
    only: Annotated[
        list[str] | None, typer.Option(metavar="EXERCISE", help="Only this exercise; may be given more than once.")
    ] = None,
    live: Annotated[bool, typer.Option("--live", help="Really drive the devices. Have them off the ground.")] = False,
    yes: Annotated[bool, typer.Option("--yes", help="With --live: do not ask.")] = False,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object per line.")] = False,
    local_connectors: LocalOption = None,
) -> None:
    """Silence, a dead link, a frozen picture, stop, strangers: what do this configuration's receivers do?

    Real configurers, limits, time-outs and robot, with server and network in memory: what the file says of a server
    is no matter. Dry by default: handle_data and
    make_safe of the plugins are replaced by recorders and no device is opened, so it shows that the framework and the
    file are right, not that the wheels stand. Exit code 1 if anything fails. Ctrl-C runs the safe actions first, then
    ends; a second one ends at once.
    """
    from mosaic_core.drill.drill import EXERCISES
    from mosaic_core.runtime.configuration.auto_configurer import AutoConfigurer
    from mosaic_core.runtime.configuration.config_loader import load_connectors

    for name in only or ():
        need_known("exercise", name, list(EXERCISES))
    resolver = resolver_beside(config, local_connectors)
    configured = AutoConfigurer(resolver=resolver).configure(load_connectors(config, resolver=resolver))
    if live and not yes:
        _confirm(configured)
    raise typer.Exit(_run(configured, live=live, only=tuple(only or ()), as_json=as_json))


def _confirm(configured: Configured) -> None:
    import sys

    labels = ", ".join(connector.config.label for connector in configured.connectors)
    if not sys.stdin.isatty():
        usage("--live drives real devices; say --yes where nobody can be asked")
    typer.secho(f"This opens and MOVES the real devices of: {labels}.", err=True, fg=typer.colors.YELLOW)
    typer.confirm("Are they free to move, and can you cut their power?", abort=True, err=True)


def _run(configured: Configured, *, live: bool, only: tuple[str, ...], as_json: bool) -> int:
    import asyncio

    from rich.console import Console

    from mosaic_core.cli.terminal.log_output import LogLevel, set_up_logging
    from mosaic_core.cli.terminal.rich_table import PIPE_WIDTH, console
    from mosaic_core.drill.drill import drill as findings_of

    set_up_logging(LogLevel.ERROR)
    found: list[DrillFinding] = []

    async def find(begun: Callable[[Rig], None]) -> None:
        with Console(stderr=True).status("drilling …") as status:
            async for finding in findings_of(configured, live=live, only=only, begun=begun):
                found.append(finding)
                status.update(f"drilling … {finding.label}: {finding.exercise} {finding.verdict}")
                if as_json:
                    typer.echo(json.dumps(asdict(finding), ensure_ascii=False))

    code = asyncio.run(_until_a_signal(find))
    if not as_json:
        _show(found, console(PIPE_WIDTH), live=live)
    return code or (FAILED if any(one.verdict == "failed" for one in found) else FINE)


async def _until_a_signal(find: Callable[[Callable[[Rig], None]], Coroutine[Any, Any, None]]) -> int:
    """Drill to the end, or until Ctrl-C or SIGTERM: then the safe actions run first, and nothing is waited for that
    hangs. The exit code of a signal, else 0."""
    import asyncio

    from mosaic_core.cli.robot.end_signals import SAFE_WITHIN_S, EndSignals

    rigs: list[Rig] = []
    are_safe: list[bool] = []
    wanted = asyncio.Event()
    make_safe = lambda: are_safe.extend(rig.make_safe(SAFE_WITHIN_S) for rig in rigs)  # noqa: E731
    signals = EndSignals(wanted, make_safe, safe_first=True)
    signals.install()
    drilling, ending = asyncio.create_task(find(rigs.append)), asyncio.create_task(wanted.wait())
    try:
        await asyncio.wait({drilling, ending}, return_when=asyncio.FIRST_COMPLETED)
        if not signals.code:
            drilling.result()
            return 0
        drilling.cancel()
        await asyncio.wait({drilling})
        _tell_interrupted(is_safe=all(are_safe) and len(are_safe) == len(rigs))
        return signals.code
    finally:
        ending.cancel()
        signals.uninstall()


def _tell_interrupted(*, is_safe: bool) -> None:
    what = "the safe actions have run" if is_safe else "a SAFE ACTION DID NOT END: look at the device"
    typer.secho(f"interrupted: {what}", err=True, fg=typer.colors.YELLOW if is_safe else typer.colors.RED)


def _show(found: list[DrillFinding], console: Console, *, live: bool) -> None:
    from rich.text import Text

    from mosaic_core.cli.terminal.rich_table import listed

    is_wide = console.width >= _TABLE_WIDTH
    columns = ("what", "connector", "limit", "measured", "gate", "", "why")[: 7 if is_wide else 6]
    rows = []
    for one in found:
        verdict = Text(one.verdict, style=_STYLES[one.verdict])
        row = (one.exercise, one.label, one.limit, one.measured, one.gate, verdict, one.why)
        rows.append(row[: len(columns)])
    table = listed(columns, rows, whole=_WHOLE)
    console.print(table if found else "no connector takes commands: nothing to exercise")
    for one in found:
        if one.why and not is_wide:
            console.print(f"{one.exercise}, {one.label}: {one.why}")
    counts = {verdict: sum(one.verdict == verdict for one in found) for verdict in _STYLES}
    console.print(", ".join(f"{count} {verdict}" for verdict, count in counts.items()))
    if not live:
        console.print("dry: no device was touched; --live drives them")
