"""Carries out ``mosaic operator stop``, ``clear``, ``lease`` and ``journal`` once they are signed in."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict
from typing import Any

import typer

from mosaic_core.cli.operator.operator_session import connected, until_closed
from mosaic_core.cli.terminal.error_report import FAILED, FINE, usage
from mosaic_core.cli.terminal.rich_table import show
from mosaic_core.operator import ControlDesk, LeaseView, MosaicOperator, RobotConnection, StopReport
from mosaic_core.operator.control.original_drives import ZerosReport
from mosaic_core.words.control import JournalEntry, PeerInfo
from mosaic_core.words.described import DescribedConnector
from mosaic_core.words.errors import ConnectionFailed, hint_at

ZERO_WAIT_S = 1.0
"""For the last zero to reach a robot that would go on without it: a bad round trip or two."""
FIRST_WORDS_S = 3.0
"""For the robot to tell who commands and whether it is stopped: it does so right after its hello."""


async def first_words(connection: RobotConnection) -> ControlDesk:
    """The control desk, once the robot has told where things stand; raises :class:`ConnectionFailed` where it knows no
    leases."""
    desk = connection.control
    if not desk.is_available:
        message = "This robot knows neither leases nor the stop: it runs an original MOSAIC, or an old version of ours."
        raise ConnectionFailed(message, code="lease.unknown_resource", cure="Update MOSAIC on the robot.")
    with suppress(TimeoutError):
        await desk.wait_for(lambda: desk.stop_state is not None and desk.leases, FIRST_WORDS_S)
    return desk


def name_of(peer: PeerInfo | None) -> str:
    """How to call somebody on the terminal."""
    if peer is None:
        return "nobody"
    kind = "" if peer.is_person else ", an original dashboard" if peer.is_original else ", a program"
    return f"{peer.name or peer.peer_id[:8]}{kind}"


def _say(line: Any, text: str, *, as_json: bool) -> None:
    typer.echo(json.dumps(line, ensure_ascii=False) if as_json else text)


# -- stop and clear ------------------------------------------------------------------------------------------------


async def stop_robot(
    operator: MosaicOperator, robot: str, reason: str, drive_label: str, drive_type: str | None, *, as_json: bool
) -> int:
    """``mosaic operator stop``. ``drive_label`` and ``drive_type``: what drives an original robot."""
    described = told_drive(drive_label, drive_type or DEFAULT_DRIVE) if drive_label else ()
    connection = await connected(operator, robot, described=described)
    if connection.is_original:
        return _told_zeros(await connection.send_zeros(), as_json=as_json)
    report = await connection.control.stop(reason)
    _say({"stopped": True, **asdict(report)}, _stop_text(report), as_json=as_json)
    if not report.is_safe:
        typer.secho("warning: a safe action of the robot is still running", err=True, fg=typer.colors.YELLOW)
    return FINE if report.is_safe else FAILED


def _told_zeros(report: ZerosReport, *, as_json: bool) -> int:
    """An original robot was not stopped, whatever reached it: the next command moves it again."""
    _say({"stopped": False, **asdict(report)}, zeros_text(report), as_json=as_json)
    if not report.is_complete:
        typer.secho("NOT STOPPED: use the switch on the robot", err=True, fg=typer.colors.RED)
    return FAILED


DEFAULT_DRIVE = "ros2-receiver-geometry-Twist"
"""What most original robots are driven by."""


def told_drive(label: str, drive_type: str) -> tuple[DescribedConnector, ...]:
    """What the command line says of an original robot's drive."""
    return (DescribedConnector(connector_id=label, connector_type=drive_type),)


def zeros_text(report: ZerosReport) -> str:
    """What became of the zeros that stand in for a stop, and nothing more than that."""
    text = "This robot has no stop: it runs an original MOSAIC."
    if report.arrived:
        labels = ", ".join(map(repr, report.arrived))
        text += f" Zeros arrived at {labels} instead; the next command moves it again."
    if report.failed:
        text += f" Zeros did NOT arrive at {', '.join(map(repr, report.failed))}."
    if not report.arrived and not report.failed:
        text += " Nobody has described what drives it, so nothing was sent: name it with --drive LABEL."
    return text


def warn_that_it_may_go_on() -> None:
    """An original robot goes on with the last command, and nobody knows whether the zero has reached it."""
    typer.secho("the last zero was NOT acknowledged: the robot may go on", err=True, fg=typer.colors.RED)


def _stop_text(report: StopReport) -> str:
    text = f"stopped: answered after {report.acknowledged_s * 1e3:.0f} ms"
    if report.safe_s is not None and report.uncertainty_s is not None:
        text += f", standing after {report.safe_s * 1e3:.0f} ± {report.uncertainty_s * 1e3:.0f} ms"
    return f"{text}. It takes no command until `mosaic operator clear`. (This is no certified emergency stop.)"


LET_GO = "Whoever sent on through the stop lets go first: by a zero, or a pause as long as the time-out."


async def clear_stop(operator: MosaicOperator, robot: str, *, as_json: bool) -> int:
    """``mosaic operator clear``. Who is no supervisor must hold a lease to clear, so it is taken for that moment; not
    for a program, which the robot refuses anyway."""
    connection = await connected(operator, robot)
    desk = await first_words(connection)
    was_stopped = desk.stop_state is None or desk.stop_state.is_stopped
    own = next((peer for peer in desk.peers if peer.peer_id == connection.peer_id), None)
    if was_stopped and own is not None and (own.role == "supervisor" or not own.is_person):
        await desk.clear_stop()
    elif was_stopped:
        async with await desk.take(next(iter(desk.leases), "motion"), reason="to clear the stop"):
            await desk.clear_stop()
    text = f"cleared: commands act again. {LET_GO}" if was_stopped else "it was not stopped"
    _say({"stopped": False, "was_stopped": was_stopped}, text, as_json=as_json)
    return FINE


async def change_stop_right(operator: MosaicOperator, robot: str, who: str, *, may_stop: bool, as_json: bool) -> int:
    """``mosaic operator stop-right``."""
    desk = await first_words(await connected(operator, robot))
    found = [peer for peer in desk.peers if who in (peer.peer_id, peer.name)]
    if not found:
        here = ", ".join(name_of(peer) for peer in desk.peers)
        usage(f"nobody here is called {who!r}; connected: {here}")
    await desk.change_stop_right(found[0].peer_id, may_stop=may_stop)
    text = f"{name_of(found[0])} may {'say stop again' if may_stop else 'no longer say stop'}"
    _say({"peer_id": found[0].peer_id, "may_stop": may_stop}, text, as_json=as_json)
    return FINE


# -- the lease -----------------------------------------------------------------------------------------------------


async def show_leases(operator: MosaicOperator, robot: str, resource: str = "", *, as_json: bool) -> int:
    """``mosaic operator lease``: who commands, who waits; for ``resource`` alone where one is named."""
    desk = await first_words(await connected(operator, robot))
    if resource and resource not in desk.leases:
        known = ", ".join(map(repr, desk.leases)) or "none"
        message = f"The robot has no resource {resource!r}{hint_at(resource, desk.leases)} It has: {known}."
        raise ConnectionFailed(message, code="lease.unknown_resource", cure="")
    views = [view for view in desk.leases.values() if resource in ("", view.resource)]
    show(("resource", "commands", "waiting"), map(_lease_row, views), map(_lease_line, views), as_json=as_json)
    if not as_json and desk.stop_state is not None and desk.stop_state.is_stopped:
        by, reason = desk.stop_state.by or "somebody", desk.stop_state.reason
        typer.echo(f"stopped by {by}{f': {reason}' if reason else ''}")
    return FINE


def _lease_row(view: LeaseView) -> tuple[str, ...]:
    waiting = ", ".join(one.name or one.peer_id[:8] for one in view.queue)
    return (view.resource, name_of(view.holder), waiting or "–")


def _lease_line(view: LeaseView) -> dict[str, Any]:
    return {
        "resource": view.resource,
        "holder": view.holder.wire() if view.holder else None,
        "epoch": view.epoch,
        "waiting": [one.wire() for one in view.queue],
    }


async def take_lease(
    operator: MosaicOperator,
    robot: str,
    resource: str,
    force_reason: str,
    wait_s: float,
    *,
    releases: bool,
    as_json: bool,
) -> int:
    """``mosaic operator lease --take``: hold it until Ctrl+C, or with ``releases`` give it back at once."""
    connection = await connected(operator, robot)
    desk = await first_words(connection)
    async with await desk.take(resource, reason=force_reason, force=bool(force_reason), wait_s=wait_s) as lease:
        held = {"resource": resource, "outcome": "granted", "epoch": lease.epoch}
        _say(held, f"holding {resource!r} (epoch {lease.epoch})", as_json=as_json)
        if not releases:
            typer.echo("Ctrl+C gives it back", err=True)
            await until_closed(connection, _tell_who_asks(desk, resource))
    _say({"resource": resource, "outcome": "released"}, f"{resource!r} is free", as_json=as_json)
    return FINE


async def _tell_who_asks(desk: ControlDesk, resource: str) -> int:
    """Until the block around it ends."""
    told, changed = set[str](), asyncio.Event()
    desk.on_change(changed.set)
    while True:
        changed.clear()
        queue = desk.leases[resource].queue if resource in desk.leases else ()
        for one in queue:
            if one.peer_id not in told:
                because = f": {one.reason}" if one.reason else ""
                typer.echo(f"{one.name or one.peer_id[:8]} asks for it{because}", err=True)
        told = {one.peer_id for one in queue}
        await changed.wait()


# -- who did what --------------------------------------------------------------------------------------------------


async def show_journal(operator: MosaicOperator, robot: str, limit: int, *, as_json: bool) -> int:
    """``mosaic operator journal``."""
    desk = await first_words(await connected(operator, robot))
    show_entries([*reversed(await desk.journal(limit))], as_json=as_json)
    return FINE


def show_entries(entries: Sequence[JournalEntry], *, as_json: bool) -> None:
    """Entries of the journal, each with its time, code and gate whole also on 80 columns."""
    when, what = "when (UTC)", "what, code, gate"
    lines = [entry.wire() for entry in entries]
    columns, rows = (when, what, "who", "of", ""), map(_journal_row, entries)
    show(columns, rows, lines, as_json=as_json, empty="nothing yet", whole=(when, what))


_SECONDS = len("2026-01-31T12:00:00.123")


def _journal_row(entry: JournalEntry) -> tuple[str, ...]:
    gate = f"at the gate {entry.gate}" if entry.gate else ""
    what = "\n".join(filter(None, (entry.what, entry.code, gate)))
    return (entry.at[:_SECONDS], what, entry.who, entry.subject, entry.message)
