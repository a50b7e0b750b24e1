"""``mosaic plugin check``: which rung of the quality ladder a plugin stands on, and what is missing to the next."""

from __future__ import annotations

import json
import logging
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, NoReturn

import typer

from mosaic_core.cli.terminal.error_report import FAILED, FINE

if TYPE_CHECKING:
    from rich.console import Console

    from mosaic_core.ladder.fault import Fault, LadderLevel
    from mosaic_core.ladder.rule import RuleFinding
    from mosaic_core.ladder.shipment import Shipment
    from mosaic_core.words.errors import CodeLine

_STYLES = {"passed": "green", "failed": "bold red", "not judged": "yellow", "does not apply": "dim"}
_MEDALS = {"bronze": "dark_orange3", "silver": "white", "gold": "gold1", None: "red"}
_MAX_FAULTS = 12
"""Of one rule, for people; JSON has all."""


def check_plugins(words: list[str], level: LadderLevel, *, as_json: bool, with_traces: bool, restarts: int) -> int:
    """Examine what ``words`` name and tell it; the exit code."""
    import asyncio

    from rich.console import Console

    from mosaic_core.cli.terminal.rich_table import PIPE_WIDTH, console
    from mosaic_core.ladder.climb import climb, is_reached
    from mosaic_core.ladder.shipment import found_shipments

    shipments, out, are_there = found_shipments(words), console(PIPE_WIDTH), True
    for shipment in shipments:

        async def findings(shipment: Shipment = shipment) -> list[RuleFinding]:
            found: list[RuleFinding] = []
            with Console(stderr=True).status(f"examining {shipment.name} …") as status:
                tell = partial(typer.echo, err=True)
                async for finding in climb(shipment, level, restarts=restarts, tell=tell):
                    found.append(finding)
                    status.update(f"examining {shipment.name} … {finding.subject}: {finding.rule.name}")
            return found

        with _quiet(), _interrupted_at_once():
            found = asyncio.run(findings())
        are_there = are_there and is_reached(level, found)
        if as_json:
            _tell_json(shipment, level, found)
        else:
            _show(out, shipment, level, found, with_traces=with_traces)
    if not shipments and not as_json:
        out.print("no distribution with connectors is installed")
    return FINE if are_there else FAILED


@contextmanager
def _quiet() -> Iterator[None]:
    """What failures of a plugin would log is told as findings."""
    before = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        yield
    finally:
        logging.disable(before)


@contextmanager
def _interrupted_at_once() -> Iterator[None]:
    """Let Ctrl-C end an import that hangs: asyncio's own handler would ask the event loop, which the import blocks.
    Main thread."""

    def interrupt(number: int, frame: FrameType | None) -> NoReturn:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGINT, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _tell_json(shipment: Shipment, level: LadderLevel, found: list[RuleFinding]) -> None:
    from mosaic_core.ladder.climb import is_reached, reached

    for one in found:
        rule = {"rule": one.rule.name, "level": one.rule.level, "subject": one.subject, "verdict": one.verdict}
        more: dict[str, Any] = {"faults": [*map(_as_json, one.faults)], "why_not": one.why_not}
        if one.faults:
            more |= {"asks": one.rule.asks, "why": one.rule.why, "cure": one.rule.cure}
        typer.echo(json.dumps({"distribution": shipment.name, **rule, **more}, ensure_ascii=False))
    summary = {"distribution": shipment.name, "version": shipment.version, "asked": level, "reached": reached(found)}
    typer.echo(json.dumps({**summary, "is_reached": is_reached(level, found)}))


def _show(out: Console, shipment: Shipment, level: LadderLevel, found: list[RuleFinding], *, with_traces: bool) -> None:
    from rich.text import Text

    from mosaic_core.cli.terminal.rich_table import listed
    from mosaic_core.ladder.climb import RULES, reached

    subjects = list(dict.fromkeys(one.subject for one in found))
    verdicts = {(one.rule.name, one.subject): one.verdict for one in found}
    asked, rows = {one.rule for one in found}, list[tuple[str | Text, ...]]()
    for rule in (one for one in RULES if one in asked):
        its = [verdicts.get((rule.name, subject), "") for subject in subjects]
        rows.append((rule.name, rule.level, *(Text(verdict, _STYLES.get(verdict, "")) for verdict in its)))
    out.print(listed(("rule", "level", *subjects), rows, whole=("rule", "level")))
    for alike in _told_once(found):
        _explain(out, alike, with_traces=with_traces)
    _tell_unjudged(out, found)
    stands = reached(found)
    out.print(Text.assemble(f"\n{shipment.source}: ", (stands or "below bronze", f"bold {_MEDALS[stands]}")), end="")
    out.print(_asked(stands, level))


def _asked(stands: LadderLevel | None, level: LadderLevel) -> str:
    """What else to know of the rung: that it is not the one that was asked for, or that nobody looked further up."""
    if stands != level:
        return f" ({level} was asked for)"
    return "" if level == "gold" else " (or higher: --level gold asks for all)"


def _tell_unjudged(out: Console, found: list[RuleFinding]) -> None:
    """One line for each reason."""
    from rich.text import Text

    rules: dict[tuple[str, str], list[str]] = {}
    for one in found:
        if one.verdict == "not judged":
            rules.setdefault((one.subject, one.why_not), []).append(one.rule.name)
    for (subject, why_not), names in rules.items():
        out.print(Text(f"\n{subject}: {why_not}; not judged: {', '.join(names)}", "yellow"))


def _told_once(found: list[RuleFinding]) -> list[list[RuleFinding]]:
    """What failed; connectors that fail by the same line together, such as those of one file that can't be imported."""
    alike: dict[object, list[RuleFinding]] = {}
    for one in found:
        if one.verdict == "failed":
            key = one.rule.name, tuple((fault.place, fault.trace or fault.message) for fault in one.faults)
            alike.setdefault(key, []).append(one)
    return list(alike.values())


def _explain(out: Console, alike: list[RuleFinding], *, with_traces: bool) -> None:
    from rich.text import Text

    one, subjects = alike[0], ", ".join(one.subject for one in alike)
    out.print(Text(f"\n{one.rule.name}, {subjects}: {one.rule.asks}", "bold"))
    for fault in one.faults[:_MAX_FAULTS]:
        out.print(Text(f"  {_shown(fault.place)}: {fault.message}" if str(fault.place) else f"  {fault.message}"))
        if fault.trace and (with_traces or one.rule.name == "loads"):
            _print_trace(out, fault)
    if len(one.faults) > _MAX_FAULTS:
        out.print(f"  and {len(one.faults) - _MAX_FAULTS} more")
    out.print(Text(f"  why:  {one.rule.why}", "dim"))
    out.print(Text(f"  cure: {one.rule.cure}"))


def _print_trace(out: Console, fault: Fault) -> None:
    from rich.text import Text

    for line in fault.trace.splitlines():
        out.print(Text(f"    {line}", "dim"))


def _as_json(fault: Fault) -> dict[str, Any]:
    place = {"file": fault.place.file, "line": fault.place.line}
    return {"message": fault.message, "place": place, "trace": fault.trace}


def _shown(place: CodeLine) -> str:
    """A place as people write it: below the current folder without that folder."""
    try:
        file = str(Path(place.file).relative_to(Path.cwd()))
    except ValueError:
        file = place.file
    return f"{file}:{place.line}" if place.line else file
