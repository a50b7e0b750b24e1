"""What ``mosaic operator`` does once its words are read: sign in, find the robot, look, send."""

from __future__ import annotations

import asyncio
import json
import os
import sys
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

import typer

from mosaic_core.adapters.event_loop import run_event_loop
from mosaic_core.cli.error_report import FAILED, FINE, USAGE
from mosaic_core.cli.log_output import LogLevel, set_up_logging
from mosaic_core.operator import (
    MediaStreamStore,
    MosaicOperator,
    MosaicStore,
    ReceivableStore,
    Received,
    RobotConnection,
    RobotConnector,
    RobotSummary,
    SendableStore,
)
from mosaic_core.words.control import Refusal
from mosaic_core.words.errors import ConnectionFailed, MosaicError, SignalingError

REFUSAL_WAIT_S = 0.5
"""After the last message, for the robot to refuse it: a long round trip."""

Work: TypeAlias = Callable[[MosaicOperator], Awaitable[int]]


@dataclass(frozen=True, slots=True, repr=False)
class SignIn:
    """Where and as whom; never printed."""

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
            _usage("--email (or MOSAIC_EMAIL) or --code is needed to sign in")
        if password_stdin:
            return cls(server, email, sys.stdin.readline().rstrip("\r\n"), "")
        password = os.environ.get("MOSAIC_PASSWORD")
        if password is None:
            if not sys.stdin.isatty():
                _usage("no password: set MOSAIC_PASSWORD or use --password-stdin")
            password = typer.prompt("Password", hide_input=True, err=True)
        return cls(server, email, password, "")

    async def operator(self) -> MosaicOperator:
        if self.code:
            return await MosaicOperator.login_with_code(self.server, self.code)
        return await MosaicOperator.login(self.server, self.email, self.password)


def _usage(message: str) -> None:
    typer.secho(f"error: {message}", err=True, fg=typer.colors.RED)
    raise typer.Exit(USAGE)


def run(sign_in: SignIn, work: Work) -> int:
    """Sign in, do ``work``, sign off; the exit code. Ctrl+C is the normal end of a look."""
    set_up_logging(LogLevel.WARNING)

    async def main() -> int:
        async with await sign_in.operator() as operator:
            return await work(operator)

    try:
        return run_event_loop(main())
    except KeyboardInterrupt:
        return FINE


async def list_robots(operator: MosaicOperator, *, as_json: bool) -> int:
    found = await operator.robots()
    connectors = {robot.id: await _labels(operator, robot) for robot in found}
    if as_json:
        for robot in found:
            typer.echo(json.dumps({**_summary(robot), "connectors": connectors[robot.id]}))
        return FINE
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="bold")
    for column in ("name", "id", "state", "connectors"):
        table.add_column(column, no_wrap=column in ("name", "id"))
    for robot in found:
        state = robot.status.name.lower().replace("_", " ")
        table.add_row(robot.name, robot.id, state, ", ".join(connectors[robot.id]))
    Console(markup=False, highlight=False).print(table if found else "no robots yet")
    return FINE


async def _labels(operator: MosaicOperator, robot: RobotSummary) -> list[str]:
    try:
        catalogue = await operator.rest.catalogue(robot.id)
    except MosaicError:
        return []  # original servers know no catalogues
    return [entry.label for entry in catalogue.entries] if catalogue else []


def _summary(robot: RobotSummary) -> dict[str, Any]:
    return {"id": robot.id, "name": robot.name, "status": robot.status.name, "isOnline": robot.is_online}


async def connected(operator: MosaicOperator, robot: str) -> RobotConnection:
    """Connect to the robot of this id or name; :class:`SignalingError` naming the robots there are."""
    found = await operator.robots()
    match = next((one for one in found if one.id == robot), None)
    if match is None:
        named = [one for one in found if one.name == robot]
        if len(named) != 1:
            problem = f"{len(named)} robots are called {robot!r}; use the id" if named else f"no robot {robot!r}"
            known = ", ".join(f"{one.name} ({one.id})" for one in found) or "none"
            raise SignalingError(problem, code="signal.unknown_connection", cure=f"robots of this account: {known}")
        match = named[0]
    return await operator.connect(match.id)


async def _until_closed(connection: RobotConnection, work: Awaitable[int]) -> int:
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


def _store(operator: MosaicOperator, connection: RobotConnection, label: str) -> MosaicStore:
    return operator.stores.get_or_create_store(RobotConnector(connection.robot_id, label))


@dataclass(frozen=True, slots=True)
class Tail:
    """``mosaic operator tail``."""

    robot: str
    label: str
    count: int | None
    as_json: bool

    async def __call__(self, operator: MosaicOperator) -> int:
        connection = await connected(operator, self.robot)
        store = _store(operator, connection, self.label)
        if isinstance(store, MediaStreamStore):
            return await _until_closed(connection, self._watch(store))
        if isinstance(store, ReceivableStore):
            return await _until_closed(connection, self._listen(store))
        raise _wrong_way(self.label, "sends nothing; use `mosaic operator send`")

    async def _listen(self, store: ReceivableStore) -> int:
        left = self.count
        async for received in store.messages():
            typer.echo(_as_json(self.label, received) if self.as_json else _as_text(received.data))
            left = None if left is None else left - 1
            if left == 0:
                break
        return FINE

    async def _watch(self, store: MediaStreamStore) -> int:
        lines, seen = 0, store.received_frames
        while self.count is None or lines < self.count:
            await asyncio.sleep(1.0)
            frame, frames = store.latest_frame, store.received_frames - seen
            seen += frames
            size = (frame.width, frame.height) if frame is not None else (0, 0)
            if self.as_json:
                typer.echo(json.dumps({"label": self.label, "width": size[0], "height": size[1], "fps": frames}))
            else:
                typer.echo(f"{size[0]}×{size[1]}, {frames} frames/s" if frame is not None else "no picture yet")
            lines += 1
        return FINE


def _wrong_way(label: str, what: str) -> ConnectionFailed:
    return ConnectionFailed(f"{label!r} {what}", code="channel.unknown_label", cure="")


def _as_text(data: bytes) -> str:
    try:
        return data.decode()
    except UnicodeDecodeError:
        shown = data[:32].hex(" ")
        return f"{len(data)} bytes: {shown}{' …' if len(data) > 32 else ''}"


def _as_json(label: str, received: Received) -> str:
    info = received.info
    try:
        value: Any = received.json()
    except ValueError:
        value = _as_text(received.data)
    line = {"label": label, "seq": info.seq, "stampUs": info.stamp_us, "ageS": info.age_s, "latched": info.is_latched}
    return json.dumps({**line, "data": value}, ensure_ascii=False)


@dataclass(frozen=True, slots=True)
class Send:
    """``mosaic operator send``."""

    robot: str
    label: str
    data: str
    period_s: float
    for_s: float

    async def __call__(self, operator: MosaicOperator) -> int:
        connection = await connected(operator, self.robot)
        store = _store(operator, connection, self.label)
        if not isinstance(store, SendableStore):
            raise _wrong_way(self.label, "takes nothing; use `mosaic operator tail`")
        refusals: list[Refusal] = []
        connection.on_refusal(refusals.append)
        await store.wait_open()
        sent = await _until_closed(connection, self._send(store))
        return self._report(sent, refusals)

    async def _send(self, store: SendableStore) -> int:
        loop = asyncio.get_running_loop()
        start_s, sent, tick = loop.time(), 0, 0
        while tick == 0 or tick * self.period_s <= self.for_s:
            await asyncio.sleep(max(0.0, start_s + tick * self.period_s - loop.time()))
            sent += store.send_data(self.data)
            tick += 1
        await asyncio.sleep(REFUSAL_WAIT_S)
        return sent

    def _report(self, sent: int, refusals: list[Refusal]) -> int:
        for refusal in refusals[:3]:
            reason = f"{refusal.code}: {refusal.message}" if refusal.message else refusal.code
            typer.secho(f"refused: {reason}", err=True, fg=typer.colors.RED)
        typer.echo(f"{sent} sent, {len(refusals)} refused")
        return FAILED if refusals or not sent else FINE
