"""``mosaic connectors``: what is installed, and what each connector's params are."""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Mapping, Sequence
from importlib.machinery import PathFinder
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mosaic_core.cli.configuration.local_option import HERE, LocalOption, resolver_beside
from mosaic_core.cli.terminal.error_report import USAGE, report_problems
from mosaic_core.words.errors import Problem

if TYPE_CHECKING:
    from mosaic_core.cli.configuration.connector_defaults import ChannelDefaults, Unmade
    from mosaic_core.contract.configurer import Configurer
    from mosaic_core.runtime.configuration.resolver import ConnectorResolver, InstalledConnector

app = typer.Typer(add_completion=False, no_args_is_help=True, help="The connector types that are installed.")

AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]


@app.command("list")
def list_types(
    as_json: AsJson = False,
    check: Annotated[bool, typer.Option("--check", help="Import each, and say what can't be used.")] = False,
) -> None:
    """List the connector types that are installed, or stand in the folder `connectors/`; imports none of them.

    With `--check` each is imported, in a process of its own that is thrown away, but for those of the folder
    `connectors/`, whose code is never run for this.
    """
    from mosaic_core.cli.configuration.broken_types import broken_types
    from mosaic_core.cli.terminal.plain_table import print_table

    resolver = resolver_beside(HERE, is_wanted=True)
    listed = {one.unreadable for one in resolver.local.connectors}
    report_problems([one for one in resolver.local.problems if one not in listed], as_hints=True)
    if resolver.local.refusal:
        typer.echo(f"left out what stands in connectors/: {resolver.local.refusal}", err=True)
    rows = [
        (one, first_docstring_line(one.entry_point, one.local.file if one.local else None)) for one in resolver.types()
    ]
    broken = broken_types(resolver, imports=check)
    if check:
        _tell_unmet(resolver)
    if as_json:
        typer.echo(json.dumps([{**_as_json(one, text), **_why_broken(one.type, broken)} for one, text in rows]))
        return
    cells = [(one.type, _told(text, broken.get(one.type)), one.distribution, one.version) for one, text in rows]
    print_table(("type", "description", "distribution", "version"), cells, folded=1)


@app.command()
def show(
    connector_type: Annotated[str, typer.Argument(metavar="TYPE", help="A type, as `connectors list` shows it.")],
    as_json: AsJson = False,
    local_connectors: LocalOption = None,
) -> None:
    """Show one connector type: its channels with what is in force by default and the fields of their messages, its
    params, the limits that it takes, and an example to paste."""
    from mosaic_core.cli.configuration.connector_description import param_tables
    from mosaic_core.cli.configuration.connector_example import example_yaml
    from mosaic_core.cli.terminal.rich_table import print_fields

    resolver = resolver_beside(HERE, local_connectors)
    configurer = resolver.resolve(connector_type)
    installed = resolver.find(connector_type)
    channels, unmade = _defaults(installed, configurer)
    if as_json:
        typer.echo(json.dumps(_full_json(installed, configurer, channels, unmade)))
        _end_if_broken(unmade)
        return
    typer.secho(connector_type, bold=True, nl=False)
    typer.echo(f"  ({installed.source})\n{(configurer.__doc__ or '').strip()}\n")
    _print_defaults(configurer, channels, unmade)
    receives = unmade is not None or any(channel["safety"] for channel in channels)
    for heading, rows in param_tables(configurer, receives=receives):
        print_fields(heading, rows)
    typer.echo("Example:\n")
    typer.echo(example_yaml(connector_type, configurer))
    _end_if_broken(unmade)


def _defaults(
    installed: InstalledConnector, configurer: type[Configurer[Any]]
) -> tuple[list[ChannelDefaults], Unmade | None]:
    """The channels that it has by default; none where it can't be made, and why."""
    from mosaic_core.cli.configuration.connector_defaults import Unmade, defaults_of

    try:
        return defaults_of(installed.type, configurer, installed), None
    except Unmade as error:
        return [], error


def _end_if_broken(unmade: Unmade | None) -> None:
    """End as `mosaic validate` would where the type can't be used by anybody."""
    if unmade is not None and unmade.is_broken:
        report_problems(unmade.problems)
        raise typer.Exit(USAGE)


def _tell_unmet(resolver: ConnectorResolver) -> None:
    """What the plugins depend on and do not find, on stderr."""
    from mosaic_core.doctor.unmet_dependencies import unmet_by_plugins

    unmet = unmet_by_plugins(resolver)
    report_problems([Problem(f"{source} {one.message}", cure=one.cure) for source, one in unmet], as_hints=True)


def _told(description: str, cause: str | None) -> str:
    return description if cause is None else f"BROKEN: {cause}"


def _why_broken(connector_type: str, broken: Mapping[str, str]) -> dict[str, str]:
    return {"broken": broken[connector_type]} if connector_type in broken else {}


def _as_json(one: InstalledConnector, description: str) -> dict[str, Any]:
    return {
        "type": one.type, "description": description, "distribution": one.distribution, "version": one.version,
    }  # fmt: skip


def _full_json(
    installed: InstalledConnector,
    configurer: type[Configurer[Any]],
    channels: Sequence[ChannelDefaults],
    unmade: Unmade | None,
) -> dict[str, Any]:
    from mosaic_core.cli.configuration.connector_description import request_schemas
    from mosaic_core.cli.configuration.connector_example import shown_example
    from mosaic_core.words.delivery import DeliveryContract

    receives = unmade is not None or any(channel["safety"] for channel in channels)
    return {
        **_as_json(installed, (configurer.__doc__ or "").strip().partition("\n")[0]),
        "params": configurer.params_model.model_json_schema(),
        **request_schemas(configurer),
        "safety": configurer.safety_model.model_json_schema() if receives else None,
        "delivery": DeliveryContract.model_json_schema(),
        "example": shown_example(installed.type, configurer),
        "channels": channels,
        **({"unmade": str(unmade)} if unmade is not None else {}),
    }


def _print_defaults(
    configurer: type[Configurer[Any]], channels: Sequence[ChannelDefaults], unmade: Unmade | None
) -> None:
    """The channels with the fields of their messages, or why nobody knows them."""
    from mosaic_core.cli.configuration.connector_defaults import lines_of
    from mosaic_core.cli.configuration.connector_description import request_schemas

    if unmade is not None:
        cause = "it can't, as is told below" if unmade.is_broken else f"with the example's params it can't: {unmade}"
        typer.echo(f"What is in force is known once it can be made; {cause}\n")
    are_asked = bool(request_schemas(configurer))  # whose question and answer have tables of their own
    for channel in channels:
        typer.secho(f"by default, channel {channel['label']}", bold=True)
        for what, how in lines_of(channel):
            typer.echo(f"  {what}: {how}")
        typer.echo()
        for way in ("takes", "sends") if not are_asked else ():
            _print_fields(way, channel[way])


def _print_fields(way: str, fields: Sequence[Mapping[str, Any]]) -> None:
    """What one way's messages have; nothing where nothing goes that way, or no model says what."""
    from mosaic_core.cli.terminal.rich_table import print_fields

    rows = [
        (one["name"], one["type"], "" if one["required"] else "yes", one["unit"], one["description"]) for one in fields
    ]
    if rows:
        print_fields(way, rows, third="may be absent")


# -- a configurer's docstring, read from its source: `mosaic connectors list` imports no plugin ----------------------


def first_docstring_line(entry_point: EntryPoint, source: Path | None = None) -> str:
    """What the class says of itself; empty where the source can't be found or read. ``source``: its file, if known."""
    if not entry_point.pattern.match(entry_point.value):  # of a broken plugin
        return ""
    source, name = source or _source_of(entry_point.module), entry_point.attr
    if source is None or not name:  # of one that names a module alone
        return ""
    try:
        text = source.read_text("utf-8")
    except (OSError, ValueError):
        return ""
    return _first_line(_class_of(text, name), name) or _first_line(text, name)


def _class_of(text: str, name: str) -> str:
    """The lines of one class: parsing a whole module takes ten times longer."""
    found = re.search(rf"^class {re.escape(name)}\b.*\n(?:[ \t].*\n|\n)*", text, re.MULTILINE)
    return found[0] if found is not None else ""


def _first_line(source: str, name: str) -> str:
    try:
        tree = ast.parse(source)
    except (SyntaxError, ValueError):
        return ""
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef) and node.name == name:
            return (ast.get_docstring(node) or "").partition("\n")[0]
    return ""


def _source_of(module: str) -> Path | None:
    top, *inner = module.split(".")
    spec = PathFinder.find_spec(top)
    if spec is None:
        return None
    if not inner:
        return Path(spec.origin) if spec.origin else None
    for folder in spec.submodule_search_locations or ():
        path = Path(folder, *inner)
        for candidate in (path.with_suffix(".py"), path / "__init__.py"):
            if candidate.is_file():
                return candidate
    return None
