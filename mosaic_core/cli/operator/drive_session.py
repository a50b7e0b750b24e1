"""``mosaic operator drive``: a person at a keyboard, twenty commands a second while a key is held."""

from __future__ import annotations

import asyncio
import json
import sys
from contextlib import AbstractAsyncContextManager, nullcontext
from dataclasses import dataclass
from typing import Any

import typer

from mosaic_core.cli.operator.control_actions import (
    ZERO_WAIT_S,
    name_of,
    told_drive,
    warn_that_it_may_go_on,
    zeros_text,
)
from mosaic_core.cli.operator.drive_keys import HeldKeys, Key
from mosaic_core.cli.operator.operator_session import connected, until_closed, wrong_way
from mosaic_core.cli.terminal.error_report import FINE, usage
from mosaic_core.operator import LeaseDenied, LeaseLost, MosaicOperator, RobotConnection, SendableStore
from mosaic_core.operator.stores.channel_plan import entry_of, naming, nothing_known, resource_of
from mosaic_core.runtime.timing.background_tasks import BackgroundTasks
from mosaic_core.words.catalogue import CatalogueEntry
from mosaic_core.words.control import Refusal
from mosaic_core.words.data_type import MosaicDataType
from mosaic_core.words.described import drive_of
from mosaic_core.words.errors import ConnectionFailed, MosaicError
from mosaic_core.words.original_types import ORIGINAL_DRIVES, DriveCommand

COMMAND_PERIOD_S = 0.05
SHOW_PERIOD_S = 0.2
OWN_COMMAND = ORIGINAL_DRIVES["twist"].model_copy(update={"zero": {"linear": {"x": 0.0}, "angular": {"z": 0.0}}})
"""What robots of ours are sent: the rest is optional there, and not every robot has it."""
ORIGINAL_HELP = "arrows/WASD move · space stands · x or Esc sends zeros (this robot has NO stop) · q leaves"
HELP = "arrows/WASD move · space stands · x or Esc STOPS the robot · C clears · G gives to who asks · q leaves"


def need_a_terminal() -> None:
    """A dead man's switch needs somebody who holds it: never driven by a pipe."""
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        usage("driving needs a keyboard: run it on a terminal (programs use mosaic_core.operator, or `operator send`)")


@dataclass(frozen=True, slots=True)
class DriveSession:
    """Drives a robot by the keys of a terminal; callable as the work of an operator session."""

    robot: str
    label: str
    linear_mps: float
    angular_radps: float
    force_reason: str
    wait_s: float
    as_json: bool
    drive_type: str | None = None

    async def __call__(self, operator: MosaicOperator) -> int:
        described = told_drive(self.label, self.drive_type) if self.drive_type else ()
        with naming(MosaicDataType.JSON_U2R):
            connection = await connected(operator, self.robot, self.label, described=described)
            command, resource = self._command(connection)
        pad = connection.sendable(self.label)
        await pad.wait_open()
        try:
            async with await self._lease(connection, resource):
                return await until_closed(connection, _Driver(self, connection, pad, command).run())
        except LeaseLost as lost:
            if lost.code != "lease.handed_over":
                raise
            typer.echo("handed over", err=True)
            return FINE

    def _command(self, connection: RobotConnection) -> tuple[DriveCommand, str | None]:
        """How the connector is commanded, and the resource that must be held for it."""
        if connection.catalogue is None:
            raise nothing_known(self.label)
        entry = entry_of(connection.catalogue, self.label)
        own = OWN_COMMAND if takes_velocities(entry) else None
        command = drive_of(entry) if connection.is_original else own
        if command is None:
            raise wrong_way(self.label, f"takes no velocities (it is a {entry.type!r})")
        return command, resource_of(entry)

    async def _lease(self, connection: RobotConnection, resource: str | None) -> AbstractAsyncContextManager[Any]:
        if resource is None or not connection.control.is_available:
            return nullcontext()
        view = connection.control.leases.get(resource)
        if view is not None and view.holder is not None and not self.force_reason:
            typer.echo(f"asking {name_of(view.holder)} …", err=True)
        return await connection.control.take(
            resource, reason=self.force_reason, force=bool(self.force_reason), wait_s=self.wait_s
        )


class _Driver:
    """Drives a robot by the keys of one session, from the first key to the last."""

    def __init__(
        self, session: DriveSession, connection: RobotConnection, pad: SendableStore, command: DriveCommand
    ) -> None:
        self._drive_command = command
        self._session = session
        self._connection = connection
        self._pad = pad
        self._keys = HeldKeys()
        self._note = ""
        self._refusals, self._last_refusal = 0, ""
        self._tasks = BackgroundTasks()
        self._quit = asyncio.Event()

    async def run(self) -> int:
        from mosaic_core.cli.operator.terminal_keys import terminal_keys

        ends = self._connection.on_refusal(self._refused)
        typer.echo(ORIGINAL_HELP if self._connection.is_original else HELP, err=True)
        try:
            async with terminal_keys(self._pressed), asyncio.TaskGroup() as group:
                tasks = [group.create_task(self._command()), group.create_task(self._show())]
                await self._quit.wait()
                for task in tasks:
                    task.cancel()
        finally:  # Ctrl+C with a key held, too: the robot need not wait until commands are overdue
            ends()
            has_left = self._send_zero() and await self._pad.wait_arrived(ZERO_WAIT_S)
            if self._connection.is_original and not has_left:
                warn_that_it_may_go_on()
        return FINE

    def _pressed(self, key: Key) -> None:
        self._keys.press(key, asyncio.get_running_loop().time())
        match key:
            case "quit":
                self._quit.set()
            case "stop":
                self._send_zero()
                self._tasks.start(self._stop())
            case "clear":
                self._tasks.start(self._clear())
            case "give":
                self._send_zero()
                self._give()
            case "stand":
                self._send_zero()
            case _:
                pass

    async def _stop(self) -> None:
        if self._connection.is_original:
            self._note = zeros_text(await self._connection.send_zeros())
            return
        try:
            report = await self._connection.control.stop("from a terminal")
        except MosaicError as error:
            self._note = f"NOT STOPPED: {error.message}"
        else:
            self._note = f"stopped in {report.acknowledged_s * 1e3:.0f} ms"

    async def _clear(self) -> None:
        try:
            await self._connection.control.clear_stop()
        except (LeaseDenied, ConnectionFailed) as error:
            self._note = f"not cleared: {error.message}"
        else:
            self._note = "cleared"

    def _refused(self, refusal: Refusal) -> None:
        self._refusals += refusal.count or 1
        self._last_refusal = f"{refusal.gate}: {refusal.code}" if refusal.gate else refusal.code

    def _give(self) -> None:
        """Hand over to whoever asks first."""
        for view in self._connection.control.leases.values():
            if view.is_mine and view.queue:
                self._connection.control.answer(view.queue[0].peer_id, grant=True, resource=view.resource)

    async def _command(self) -> None:
        loop = asyncio.get_running_loop()
        while True:
            if self._keys.wants_to_send(loop.time()):
                velocity = self._keys.velocity(loop.time())
                self._send(velocity.ahead * self._session.linear_mps, velocity.left * self._session.angular_radps)
            await asyncio.sleep(COMMAND_PERIOD_S)

    def _send_zero(self) -> bool:
        return self._send(0.0, 0.0)

    def _send(self, ahead: float, left: float) -> bool:
        return self._pad.send_json(self._drive_command.message(ahead, left))

    async def _show(self) -> None:
        """A status line that stays in its place, or one JSON object per change."""
        if self._session.as_json:
            last: dict[str, Any] = {}
            while True:
                if (now := self._status()) != last:
                    typer.echo(json.dumps(now, ensure_ascii=False))
                    last = now
                await asyncio.sleep(SHOW_PERIOD_S)
        from rich.console import Console
        from rich.live import Live

        with Live(console=Console(highlight=False), auto_refresh=False, transient=True) as live:
            while True:
                live.update(status_text(self._status()), refresh=True)
                await asyncio.sleep(SHOW_PERIOD_S)

    def _status(self) -> dict[str, Any]:
        control = self._connection.control
        velocity = self._keys.velocity(asyncio.get_running_loop().time())
        limit, stopped = control.limits.get(self._session.label), control.stop_state
        round_trip_ms = self._connection.round_trip_ms
        return {
            "linear_mps": velocity.ahead * self._session.linear_mps,
            "angular_radps": velocity.left * self._session.angular_radps,
            "holders": {view.resource: name_of(view.holder) for view in control.leases.values()},
            "asking": [one.name or one.peer_id[:8] for view in control.leases.values() for one in view.queue],
            "stopped_by": (stopped.by or "somebody") if stopped is not None and stopped.is_stopped else None,
            "speed_factor": 1.0 if limit is None else limit.factor,
            "limited_by": [cause.cause for cause in limit.causes if cause.factor < 1] if limit is not None else [],
            "round_trip_ms": None if round_trip_ms is None else round(round_trip_ms, 1),
            "refusals": self._refusals,
            "last_refusal": self._last_refusal,
            "note": self._note,
        }


def takes_velocities(entry: CatalogueEntry) -> bool:
    """Whether its messages have ``linear`` and ``angular``, as velocity commands do."""
    properties = (entry.message_schema or {}).get("properties", {})
    return entry.data_type.direction is not entry.data_type.direction.TO_OPERATOR and {
        "linear", "angular",
    } <= set(properties)  # fmt: skip


def status_text(status: dict[str, Any]) -> Any:
    """The status line, as rich text."""
    from rich.text import Text

    text = Text(f"{status['linear_mps']:+.2f} m/s  {status['angular_radps']:+.2f} rad/s", style="bold")
    factor = status["speed_factor"]
    style = "green" if factor >= 1 else "yellow" if factor > 0 else "bold red"
    because = f" ({', '.join(status['limited_by'])})" if status["limited_by"] else ""
    text.append(f"   speed {factor:.0%}{because}", style=style)
    trip = status["round_trip_ms"]
    text.append(f"   round trip {'–' if trip is None else f'{trip:.0f} ms'}", style="dim")
    for resource, holder in status["holders"].items():
        text.append(f"   {resource}: {holder}", style="dim")
    if status["stopped_by"]:
        text.append(f"   STOPPED by {status['stopped_by']}", style="bold red")
    if status["asking"]:
        text.append(f"   {', '.join(status['asking'])} asks to drive", style="yellow")
    if status["refusals"]:
        text.append(f"   {status['refusals']} refused ({status['last_refusal']})", style="yellow")
    if status["note"]:
        text.append(f"   {status['note']}")
    return text
