"""``mosaic operator send``: one message, or many; the lease is taken where the connector wants one."""

from __future__ import annotations

import asyncio
import json
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass

import typer

from mosaic_core.cli.operator.control_actions import ZERO_WAIT_S, told_drive, warn_that_it_may_go_on
from mosaic_core.cli.operator.operator_session import connected, store_of, until_closed, wrong_way
from mosaic_core.cli.terminal.error_report import FAILED, FINE
from mosaic_core.operator import MosaicOperator, RobotConnection, SendableStore
from mosaic_core.operator.control.original_drives import command_of, is_zero, leave_at_zero
from mosaic_core.operator.stores.channel_plan import entry_of, naming, resource_of
from mosaic_core.words.codes import REASONS
from mosaic_core.words.control import Refusal
from mosaic_core.words.data_type import MosaicDataType
from mosaic_core.words.errors import ConnectionFailed, whole_sentence

REFUSAL_WAIT_S = 0.5
"""After the last message, for the robot to refuse it: a long round trip."""


@asynccontextmanager
async def leased(connection: RobotConnection, label: str) -> AsyncIterator[str | None]:
    """Hold what commanding ``label`` needs; the resource, ``None`` where it needs none."""
    catalogue = None if connection.is_original else connection.catalogue
    resource = resource_of(entry_of(catalogue, label)) if catalogue else None
    if resource is None or not connection.control.is_available:
        yield None
        return
    async with await connection.control.take(resource):
        yield resource


@dataclass(frozen=True, slots=True)
class SendAction:
    """The work of ``mosaic operator send``: sends messages to one connector."""

    robot: str
    label: str
    data: str
    period_s: float
    for_s: float
    as_json: bool = False
    data_type: str | None = None
    drive_type: str | None = None

    async def __call__(self, operator: MosaicOperator) -> int:
        described = told_drive(self.label, self.drive_type) if self.drive_type else ()
        with naming(MosaicDataType.JSON_U2R):
            connection = await connected(operator, self.robot, self.label, self.data_type, described)
            store = store_of(operator, connection, self.label, self.data_type)
        if not isinstance(store, SendableStore):
            raise wrong_way(self.label, "takes nothing; use `mosaic operator tail`")
        self._check_json(store)
        refusals: list[Refusal] = []
        connection.on_refusal(refusals.append)
        await store.wait_open()
        async with leased(connection, self.label) as resource:
            if resource is not None:
                typer.echo(f"holding the lease of {resource!r}", err=True)
            sent = await until_closed(connection, self._send(connection, store))
            arrived = await store.wait_arrived()
        if connection.is_original:
            return self._report_of_an_original(sent, arrived, await self._stand(connection, store))
        return self._report(sent, refusals)

    def _check_json(self, store: SendableStore) -> None:
        """An original robot does not say that it could not read a message. Raises ``channel.invalid``."""
        data_type = store.robot_connector.data_type or MosaicDataType.JSON_U2R
        if not data_type.value.startswith("json"):
            return
        try:
            json.loads(self.data)
        except ValueError as error:
            message = f"{self.label!r} takes JSON, and this is none: {error}"
            cure = """Write one JSON value in single quotes: '{"linear": {"x": 0.1}}'."""
            raise ConnectionFailed(message, code="channel.invalid", cure=cure) from error

    async def _stand(self, connection: RobotConnection, store: SendableStore) -> bool | None:
        """A drive of an original robot goes on with the last command: let it be a zero. Whether that has arrived;
        ``None``: it is no drive that is known, or was told to stand already."""
        command = command_of(connection.known, self.label)
        if command is None or is_zero(store.last_sent, command):
            return None
        return await leave_at_zero(store, command, ZERO_WAIT_S)

    async def _send(self, connection: RobotConnection, store: SendableStore) -> int:
        loop = asyncio.get_running_loop()
        start_s, sent, tick = loop.time(), 0, 0
        while tick == 0 or tick * self.period_s <= self.for_s:
            await asyncio.sleep(max(0.0, start_s + tick * self.period_s - loop.time()))
            sent += store.send_data(self.data)
            tick += 1
        is_quiet = connection.is_original  # it refuses nothing aloud; the last command counts as long as any other
        await asyncio.sleep(min(self.period_s, REFUSAL_WAIT_S) if is_quiet else REFUSAL_WAIT_S)
        return sent

    def _report_of_an_original(self, sent: int, arrived: bool, stands: bool | None) -> int:
        """It refuses nothing aloud, and knows no numbers: what is known is whether its network side has it."""
        text = f"{sent} sent, {_how(arrived)}; an original robot does not say what it refuses"
        line = {"sent": sent, "arrived": arrived}
        if stands is not None:
            text += f"\na zero after them, {_how(stands)}: it would have gone on with the last command"
            line["zero_arrived"] = stands
        typer.echo(json.dumps(line) if self.as_json else text)
        if stands is False:
            warn_that_it_may_go_on()
        return FINE if sent and arrived and stands is not False else FAILED

    def _report(self, sent: int, refusals: list[Refusal]) -> int:
        firsts = {(one.code, one.gate): one for one in reversed(refusals)}
        for refusal in sorted(firsts.values(), key=refusals.index):
            typer.secho(f"refused{refusal_text(refusal)}", err=True, fg=typer.colors.RED)
        counts = Counter[str]()
        for refusal in refusals:
            counts[refusal.code] += refusal.count or 1
        count, codes = counts.total(), sorted(counts)
        if count > len(firsts):
            told = ", ".join(f"{times} × {code}" for code, times in counts.items())
            typer.secho(f"refused in all: {told}", err=True, fg=typer.colors.RED)
        gates = sorted({refusal.gate for refusal in refusals if refusal.gate})
        line = {"sent": sent, "refused": count, "codes": codes, "gates": gates}
        typer.echo(json.dumps(line) if self.as_json else f"{sent} sent, {count} refused")
        return FAILED if refusals or not sent else FINE


def refusal_text(refusal: Refusal) -> str:
    """`` at the gate age (safety.stale): The command took too long …``, and how many it speaks for."""
    gate = f" at the gate {refusal.gate}" if refusal.gate else ""
    reason = REASONS.get(refusal.code)
    said = refusal.message or (reason.sentence if reason else "nothing else is known of it")
    cure = f" {reason.cure}" if reason and reason.cure else ""
    more = f" (and {refusal.count - 1} more)" if refusal.count and refusal.count > 1 else ""
    return f"{gate}: {refusal.code}: {whole_sentence(said)}{cure}{more}"


def _how(arrived: bool) -> str:
    return "arrived" if arrived else "NOT acknowledged"
