"""``mosaic connectors``: what is installed, and what each connector's params are."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from rich.table import Table

    from mosaic_core.contract.configurer import Configurer
    from mosaic_core.runtime.configuration.resolver import InstalledConnector

app = typer.Typer(add_completion=False, no_args_is_help=True, help="The connector types that are installed.")

AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]


@app.command("list")
def list_types(as_json: AsJson = False) -> None:
    """List the installed connector types; imports none of them."""
    from mosaic_core.cli.configuration.plugin_docstring import first_docstring_line
    from mosaic_core.cli.terminal.plain_table import print_table
    from mosaic_core.runtime.configuration.resolver import ConnectorResolver

    rows = [(one, first_docstring_line(one.entry_point)) for one in ConnectorResolver().types()]
    if as_json:
        typer.echo(json.dumps([_as_json(one, text) for one, text in rows]))
        return
    cells = [(one.type, text, one.distribution, one.version) for one, text in rows]
    print_table(("type", "description", "distribution", "version"), cells, folded=1)


@app.command()
def show(
    connector_type: Annotated[str, typer.Argument(metavar="TYPE", help="A type, as `connectors list` shows it.")],
    as_json: AsJson = False,
) -> None:
    """Show the params of one connector type, what limits it takes, and an example to paste."""
    from mosaic_core.cli.configuration.connector_description import example_yaml, param_tables
    from mosaic_core.runtime.configuration.resolver import ConnectorResolver

    resolver = ConnectorResolver()
    configurer = resolver.resolve(connector_type)
    installed = resolver.find(connector_type)
    if as_json:
        typer.echo(json.dumps(_full_json(installed, configurer)))
        return
    typer.secho(connector_type, bold=True, nl=False)
    typer.echo(f"  ({installed.source})\n{(configurer.__doc__ or '').strip()}\n")
    for heading, rows in param_tables(configurer):
        table = _table(heading, "type", "default", "unit", "description")
        for row in rows:
            table.add_row(*row)
        _print(table)
        typer.echo()
    typer.echo("Example:\n")
    typer.echo(example_yaml(connector_type, configurer))


def _as_json(one: InstalledConnector, description: str) -> dict[str, Any]:
    return {
        "type": one.type, "description": description, "distribution": one.distribution, "version": one.version,
    }  # fmt: skip


def _full_json(installed: InstalledConnector, configurer: type[Configurer[Any]]) -> dict[str, Any]:
    from mosaic_core.cli.configuration.connector_description import example_of
    from mosaic_core.words.delivery import DeliveryContract

    return {
        **_as_json(installed, (configurer.__doc__ or "").strip().partition("\n")[0]),
        "params": configurer.params_model.model_json_schema(),
        "safety": configurer.safety_model.model_json_schema(),
        "delivery": DeliveryContract.model_json_schema(),
        "example": example_of(installed.type, configurer),
    }


def _table(*columns: str) -> Table:
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="bold", padding=(0, 2, 0, 0))
    for column in columns:
        # Names are pasted into files: they are never cut or wrapped, descriptions may be.
        table.add_column(column, overflow="fold", no_wrap=column not in ("description", "default", "type"))
    return table


def _print(table: Table) -> None:
    from mosaic_core.cli.terminal.rich_table import console

    console(pipe_width=200).print(table)  # one row per line, for grep
