"""``mosaic operator call --schema``: what a connector that answers requests is asked, and what it answers."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import typer

from mosaic_core.cli.configuration.connector_description import message_rows
from mosaic_core.cli.operator.operator_session import connected
from mosaic_core.cli.terminal.error_report import FINE
from mosaic_core.cli.terminal.rich_table import print_fields
from mosaic_core.operator import MosaicOperator
from mosaic_core.operator.stores.channel_plan import answering_entry


@dataclass(frozen=True, slots=True)
class RequestSchema:
    """The work of ``mosaic operator call --schema``: prints both schemas as tables, or as one JSON object."""

    robot: str
    label: str
    as_json: bool = False

    async def __call__(self, operator: MosaicOperator) -> int:
        connection = await connected(operator, self.robot)
        entry = answering_entry(self.label, connection.known)
        schemas = {"question": entry.message_schema or {}, "answer": entry.answer_schema or {}}
        if self.as_json:
            typer.echo(json.dumps({"label": self.label, **schemas}, ensure_ascii=False))
            return FINE
        for what, schema in schemas.items():
            _print_schema(what, schema)
        return FINE


def _print_schema(what: str, schema: dict[str, Any]) -> None:
    if schema.get("description"):
        typer.echo(f"{what}: {schema['description']}")
    rows = message_rows(schema)
    if rows:
        print_fields(what, rows)
    else:
        typer.echo(f"{what}: {'no fields' if schema.get('type') == 'object' else 'any JSON'}\n")
