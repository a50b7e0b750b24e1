"""``mosaic operator call``: one request to a connector that answers; the lease is taken where it wants one."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import typer

from mosaic_core.cli.operator.operator_send import leased
from mosaic_core.cli.operator.operator_session import connected, until_closed
from mosaic_core.cli.terminal.error_report import FINE, usage
from mosaic_core.operator import MosaicOperator, RobotConnection
from mosaic_core.operator.stores.channel_plan import check_answers
from mosaic_core.operator.stores.request_caller import RequestRefused
from mosaic_core.words.data_type import MosaicDataType
from mosaic_core.words.errors import ConnectionFailed


@dataclass(frozen=True, slots=True)
class Call:
    """The work of ``mosaic operator call``: asks one connector, and prints its answer."""

    robot: str
    label: str
    question: Any
    timeout_s: float | None
    as_json: bool = False

    async def __call__(self, operator: MosaicOperator) -> int:
        connection = await self._connected(operator)
        async with leased(connection, self.label) as resource:
            if resource is not None:
                typer.echo(f"holding the lease of {resource!r}", err=True)
            return await until_closed(connection, self._ask(connection))

    async def _connected(self, operator: MosaicOperator) -> RobotConnection:
        try:
            return await connected(operator, self.robot, self.label, MosaicDataType.JSON_BI)
        except ConnectionFailed as error:
            if error.code != "channel.wrong_direction":
                raise
            # Only the robot itself says what answers; what the server has of it is too short.
            connection = await connected(operator, self.robot)
            check_answers(self.label, connection.known)
            raise

    async def _ask(self, connection: RobotConnection) -> int:
        try:
            answer = await connection.request(
                self.label,
                self.question,
                timeout_s=self.timeout_s,
                on_progress=lambda value: typer.echo(_line(value), err=True),
            )
        except RequestRefused as refused:
            if refused.code == "channel.invalid":
                refused.cure = f"`mosaic operator call {self.robot!r} {self.label} --schema` shows what may be asked."
            raise
        typer.echo(_line(answer) if self.as_json else json.dumps(answer, indent=2, ensure_ascii=False))
        return FINE


def question_in(text: str) -> Any:
    """The question that somebody typed; ends the command where it is no JSON, before anybody signs in."""
    try:
        return json.loads(text)
    except ValueError as error:
        usage(f"a question is JSON, and this is none: {error}", """write it in single quotes: '{"n": 1}'""")


def _line(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False)
