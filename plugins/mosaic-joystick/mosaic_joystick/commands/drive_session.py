"""``mosaic joystick drive``: a person with a stick, twenty commands a second while the dead man's button is held.

It is an operator like any other, also on the robot's own computer: the same lease, the same envelope, the same journal.
"""

from __future__ import annotations

import asyncio
import json
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

import typer

from mosaic_core import DeviceGone
from mosaic_core.cli.operator.drive_session import takes_velocities
from mosaic_core.cli.operator.operator_session import connected, until_closed, wrong_way
from mosaic_core.messages import STANDSTILL, Twist
from mosaic_core.operator import Lease, LeaseDenied, LeaseLost, MosaicOperator, RobotConnection, SendableStore
from mosaic_core.operator.stores.channel_plan import entry_of, nothing_known, resource_of
from mosaic_core.words.control import Refusal
from mosaic_joystick.commands.dead_man import DeadMan
from mosaic_joystick.commands.stick_mapping import StickMapping, Wishes
from mosaic_joystick.sticks import OpenStick, opened

PERIOD_S = 0.05
RETRY_S = 1.0
ZERO_WAIT_S = 1.0
"""At the end, for the robot to have the last zero; it stands without it, after its time-out."""


@dataclass(frozen=True, slots=True)
class StickDrive:
    """Drives a robot by a joystick; callable as the work of an operator session."""

    robot: str
    label: str
    stick: str
    dead_zone: float
    wishes: Wishes
    force_reason: str
    wait_s: float
    as_json: bool

    async def __call__(self, operator: MosaicOperator) -> int:
        connection = await connected(operator, self.robot)
        resource = self._resource(connection)
        store = connection.sendable(self.label)
        await store.wait_open()
        return await until_closed(connection, _StickDriver(self, connection, store, resource).run())

    def _resource(self, connection: RobotConnection) -> str | None:
        """What must be held. Raises :class:`~mosaic_core.words.errors.MosaicError` where a stick must not drive."""
        if connection.catalogue is None:
            raise nothing_known(self.label)
        entry = entry_of(connection.catalogue, self.label)
        if connection.is_original:
            raise wrong_way(self.label, "is an original robot's, which has no lease: use `mosaic operator drive`")
        if not takes_velocities(entry):
            raise wrong_way(self.label, f"takes no velocities (it is a {entry.type!r})")
        return resource_of(entry)


class _StickDriver:
    """Drives by one stick, which may be unplugged and come back, until Ctrl+C or the end of the connection."""

    def __init__(
        self, session: StickDrive, connection: RobotConnection, store: SendableStore, resource: str | None
    ) -> None:
        self._session = session
        self._connection = connection
        self._store = store
        self._resource = resource
        self._dead_man = DeadMan()
        self._lease: Lease | None = None
        self._is_driving = False
        self._told = ""

    async def run(self) -> int:
        ends = self._connection.on_refusal(self._refused)
        try:
            while True:
                try:
                    await self._with_a_stick()
                except DeviceGone as gone:
                    self._let_go()
                    self._say("gone", gone.message)
                self._dead_man.disarm()
                await asyncio.sleep(RETRY_S)
        finally:
            ends()
            self._let_go()
            await self._store.wait_arrived(ZERO_WAIT_S)

    async def _with_a_stick(self) -> None:
        with ExitStack() as stack:
            its = await asyncio.to_thread(stack.enter_context, opened(self._session.stick, self._session.dead_zone))
            mapping = StickMapping.of(its.stick, self._session.wishes)
            button = list(its.stick.buttons.values())[mapping.dead_man]
            self._say("ready", f"{its.stick.name}: hold '{button}' to drive")
            while True:
                await self._step(its, mapping)
                await asyncio.sleep(PERIOD_S)

    async def _step(self, its: OpenStick, mapping: StickMapping) -> None:
        reading = its.read(asyncio.get_running_loop().time())
        if not self._dead_man.may_drive(mapping.is_held(reading)):
            self._let_go()
        elif await self._may_command():
            self._send(mapping.twist(its.read(asyncio.get_running_loop().time())))

    async def _may_command(self) -> bool:
        """Hold the lease, taking it if need be; who is refused, or loses it, lets the button go first."""
        if self._resource is None or (self._lease is not None and self._lease.is_held):
            return True
        try:
            if self._lease is not None and self._lease.lost is not None:
                raise self._lease.lost
            force = self._session.force_reason
            self._lease = await self._connection.control.take(
                self._resource, reason=force, force=bool(force), wait_s=self._session.wait_s
            )
        except (LeaseDenied, LeaseLost) as error:
            self._lease, self._is_driving = None, False
            self._dead_man.disarm()
            self._say("denied", f"{error.code}: {error.message} Let the button go, and press it again.")
            return False
        return True

    def _send(self, twist: Twist) -> None:
        if not self._is_driving:
            self._say("driving", "driving")
        self._is_driving = True
        self._store.send_json(twist)

    def _let_go(self) -> None:
        """Tell the robot to stand, and let others drive."""
        if self._is_driving:
            self._store.send_json(STANDSTILL)
            self._say("stands", "stands")
        self._is_driving = False
        if self._lease is not None:
            self._lease.release()
            self._lease = None

    def _refused(self, refusal: Refusal) -> None:
        self._say("refused", f"{refusal.code}: {refusal.message}" if refusal.message else refusal.code)

    def _say(self, what: str, words: str) -> None:
        """One line per change."""
        if words == self._told:
            return
        self._told = words
        line: dict[str, Any] = {"state": what, "message": words}
        typer.echo(json.dumps(line, ensure_ascii=False) if self._session.as_json else words)
