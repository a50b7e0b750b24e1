"""Signs ``mosaic operator`` in and connects it to the robot, once its words are read."""

from __future__ import annotations

import asyncio
import os
import signal
import sys
import threading
from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import NoReturn

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from mosaic_core.adapters.machine.event_loop import run_event_loop
from mosaic_core.cli.terminal.error_report import FAILED, FINE, usage
from mosaic_core.cli.terminal.log_output import LogLevel, set_up_logging
from mosaic_core.cli.terminal.rich_table import show
from mosaic_core.machines.peers.connection_timeline import ConnectionTimeline
from mosaic_core.operator import MosaicOperator, MosaicStore, RobotConnection, RobotConnector, RobotSummary
from mosaic_core.operator.lan.paired_robots import PairedRobots
from mosaic_core.words.codes import reason
from mosaic_core.words.described import DescribedConnector, described_catalogue
from mosaic_core.words.errors import ConnectionFailed, MosaicError, SignalingError, hint_at, nearest
from mosaic_core.words.timeline import MOMENT_TITLES


@dataclass(frozen=True, slots=True, repr=False)
class SignIn:
    """The server and account to sign in with; never printed."""

    server: str
    email: str
    password: str
    code: str

    @classmethod
    def asked(cls, server: str, email: str, code: str, *, password_stdin: bool) -> SignIn:
        """What the command line, the environment and, on a terminal, the person say."""
        if code:
            return cls(server, "", "", code)
        if not email:
            usage(
                "--email (or MOSAIC_EMAIL) or --code is needed to sign in, or a robot paired by `mosaic operator pair` "
                "(`mosaic operator robots --lan` lists them)"
            )
        if password_stdin:
            return cls(server, email, sys.stdin.readline().rstrip("\r\n"), "")
        password = os.environ.get("MOSAIC_PASSWORD")
        if password is None:
            if not sys.stdin.isatty():
                usage("no password: set MOSAIC_PASSWORD or use --password-stdin")
            password = typer.prompt("Password", hide_input=True, err=True)
        return cls(server, email, password, "")

    async def operator(self, *, is_person: bool = False) -> MosaicOperator:
        if self.code:
            return await MosaicOperator.login_with_code(self.server, self.code, is_person=is_person)
        return await MosaicOperator.login(self.server, self.email, self.password, is_person=is_person)


@dataclass(frozen=True, slots=True)
class PairedSignIn:
    """Signs in to the robot of this name, id or address, which this machine is paired with."""

    robot: str

    async def operator(self, *, is_person: bool = False) -> MosaicOperator:
        return await MosaicOperator.find(self.robot, is_person=is_person)


def refuse_unpaired(robot: str, words_for: Callable[[str], str]) -> NoReturn:
    """End where no account is named and no paired robot goes by this; ``words_for``: what would reach another one."""
    paired = [one.name for one in PairedRobots().all()]
    meant = nearest(robot, paired)
    message = f"no account is named, and this machine is not paired with a robot {robot!r}"
    if meant is not None:
        usage(f"{message}; did you mean {meant!r}?", f"write {words_for(meant)}")
    known = f"; it is with {', '.join(map(repr, paired))}" if paired else ""
    pairing = "pair with it by `mosaic operator pair` (`mosaic operator robots --lan` lists who is near)"
    usage(f"{message}{known}", f"{pairing}, or sign in: --email (or MOSAIC_EMAIL), or --code")


def is_paired(robot: str) -> bool:
    """Whether this machine is paired with a robot that goes by this."""
    try:
        PairedRobots().named(robot)
    except SignalingError as error:
        return error.code == "lan.several"
    return True


def run(
    sign_in: SignIn | PairedSignIn,
    work: Callable[[MosaicOperator], Awaitable[int]],
    *,
    is_person: bool = False,
    shows_timeline: bool = False,
    interrupted: str = "",
) -> int:
    """Sign in, do ``work``, sign off; the exit code. Ctrl+C, as SIGTERM, is the normal end of a look; where it cuts
    something short, ``interrupted`` is told, and it is a failure.

    ``is_person``: somebody sits at the terminal and decides; robots let programs give way to persons. How far a
    connection got that failed is always shown, that of others with ``shows_timeline``.
    """
    set_up_logging(LogLevel.WARNING)

    async def main() -> int:
        _end_by_sigterm()
        async with await sign_in.operator(is_person=is_person) as operator:
            try:
                return await work(operator)
            finally:
                _show_timelines(operator, shows_all=shows_timeline)

    try:
        return run_event_loop(main())
    except (KeyboardInterrupt, asyncio.CancelledError):
        if interrupted:
            typer.echo(interrupted, err=True)
        return FAILED if interrupted else FINE


def _end_by_sigterm() -> None:
    """A service that is stopped gives its lease back too. Where there are no such signals, or off the main thread, the
    robot's own time-outs hold it."""
    ends = asyncio.current_task()
    if ends is not None and threading.current_thread() is threading.main_thread():
        with suppress(NotImplementedError):
            asyncio.get_running_loop().add_signal_handler(signal.SIGTERM, ends.cancel)


def _show_timelines(operator: MosaicOperator, *, shows_all: bool) -> None:
    for timeline in operator.timelines.values():
        was_never_up = bool(timeline.code) and timeline.at_ms("control") is None
        if was_never_up or (shows_all and timeline.marks):
            print_timeline(timeline)


async def list_robots(operator: MosaicOperator, *, as_json: bool) -> int:
    found = await operator.robots()
    connectors = {robot.id: await _labels(operator, robot) for robot in found}
    rows = [
        (one.name, one.id, one.status.name.lower().replace("_", " "), ", ".join(connectors[one.id])) for one in found
    ]
    lines = [
        {"id": one.id, "name": one.name, "status": one.status.name, "isOnline": one.is_online,
         "connectors": connectors[one.id]}
        for one in found
    ]  # fmt: skip
    columns = ("name", "id", "state", "connectors")
    show(columns, rows, lines, as_json=as_json, empty="no robots yet", whole=("name", "id"))
    return FINE


async def _labels(operator: MosaicOperator, robot: RobotSummary) -> list[str]:
    try:
        catalogue = await operator.rest.catalogue(robot.id)
    except MosaicError:
        return []
    if catalogue is None:
        catalogue = described_catalogue(await operator.rest.described(robot.id))
    return [entry.label for entry in catalogue.entries]


async def connected(
    operator: MosaicOperator,
    robot: str,
    label: str = "",
    data_type: str | None = None,
    described: Sequence[DescribedConnector] = (),
) -> RobotConnection:
    """Connect to the robot of this id or name; :class:`SignalingError` naming the robots there are.

    ``label`` is the one connector that will be used: an original robot then sends no camera that nobody looks at.
    """
    found = await operator.robots()
    wanted = operator.paired_id or robot
    match = next((one for one in found if one.id == wanted), None)
    if match is None:
        named = [one for one in found if one.name == robot]
        if len(named) != 1:
            problem = f"{len(named)} robots are called {robot!r}; use the id" if named else _no_robot(robot, found)
            known = ", ".join(f"{one.name} ({one.id})" for one in found) or "none"
            cure = f"robots of this account: {known}{_paired_instead(robot)}"
            raise SignalingError(problem, code="auth.unknown_robot", cure=cure)
        match = named[0]
    connectors = [RobotConnector(match.id, label, data_type)] if label else []
    return await operator.connect(match.id, connectors=connectors, described=described)


def _no_robot(robot: str, found: Sequence[RobotSummary]) -> str:
    return f"no robot {robot!r}{hint_at(robot, (one.name for one in found))}"


def _paired_instead(robot: str) -> str:
    """Whom ``--lan`` would reach, where that may be meant."""
    try:
        meant = nearest(robot, [one.name for one in PairedRobots().all()])
    except MosaicError:  # what is kept of paired robots is no matter to who signs in
        return ""
    return f"; with --lan this machine reaches {meant!r}, which it is paired with" if meant is not None else ""


async def until_closed(connection: RobotConnection, work: Awaitable[int]) -> int:
    """``work``, unless the connection ends before: then its reason is raised."""
    working, ending = asyncio.ensure_future(work), asyncio.ensure_future(connection.wait_closed())
    try:
        await asyncio.wait({working, ending}, return_when=asyncio.FIRST_COMPLETED)
        if working.done():
            return working.result()
        raise ending.result()
    finally:
        working.cancel()
        ending.cancel()
        await asyncio.wait({working, ending})


def store_of(
    operator: MosaicOperator, connection: RobotConnection, label: str, data_type: str | None = None
) -> MosaicStore:
    return operator.stores.get_or_create_store(RobotConnector(connection.robot_id, label, data_type))


def wrong_way(label: str, what: str) -> ConnectionFailed:
    return ConnectionFailed(f"{label!r} {what}", code="channel.wrong_direction", cure="")


BAR_CELLS = 24


def timeline_table(timeline: ConnectionTimeline) -> Table:
    """One row per moment; the last is the end, where there was one before the connection was of use."""
    end_ms = max([one.at_ms for one in timeline.marks] + [timeline.ended_ms or 0.0, 1.0])
    table = Table(box=None, pad_edge=False, show_header=False, padding=(0, 2, 0, 0))
    table.add_column(no_wrap=True)
    table.add_column(justify="right", no_wrap=True)
    table.add_column(no_wrap=True)
    table.add_column()
    before_ms = 0.0
    for mark in timeline.marks:
        bar = Text(_bar(before_ms, mark.at_ms, end_ms), style="cyan")
        table.add_row(MOMENT_TITLES[mark.moment], f"{mark.at_ms:.0f} ms", bar, Text(mark.detail, style="dim"))
        before_ms = mark.at_ms
    if timeline.ended_ms is not None and timeline.code != "peer.closed":
        bar = Text(_bar(before_ms, timeline.ended_ms, end_ms), style="red")
        known = reason(timeline.code).sentence
        table.add_row(Text("Ended", style="red"), f"{timeline.ended_ms:.0f} ms", bar, Text(f"{timeline.code}: {known}"))
    return table


def print_timeline(timeline: ConnectionTimeline) -> None:
    """To stderr: what a command prints on stdout stays as it is."""
    Console(stderr=True, highlight=False, markup=False).print(timeline_table(timeline))


def _bar(from_ms: float, to_ms: float, end_ms: float) -> str:
    start = int(from_ms / end_ms * BAR_CELLS)
    length = max(1, round((to_ms - from_ms) / end_ms * BAR_CELLS))
    return " " * min(start, BAR_CELLS - 1) + "█" * min(length, BAR_CELLS - min(start, BAR_CELLS - 1))
