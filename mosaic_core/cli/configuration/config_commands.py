"""``mosaic config``: a file to start from, and its schema for editors."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Annotated

import typer

from mosaic_core.cli.terminal.error_report import usage

app = typer.Typer(add_completion=False, no_args_is_help=True, help="The robot's YAML file.")


@app.command()
def schema() -> None:
    """Print the JSON Schema of the file, with the params of every installed connector.

    Editors complete and check from it; with the YAML language server, for example, write the output to
    mosaic.schema.json and put `# yaml-language-server: $schema=mosaic.schema.json` at the top of the YAML file.
    """
    from mosaic_core.cli.configuration.config_schema import config_schema
    from mosaic_core.runtime.configuration.resolver import ConnectorResolver

    result, broken = config_schema(ConnectorResolver())
    for error in broken:
        typer.secho(f"left out: {error.message}", err=True, fg=typer.colors.YELLOW)
    typer.echo(json.dumps(result, indent=2, ensure_ascii=False))


@app.command()
def init(
    path: Annotated[Path, typer.Argument(help="The file to write.")] = Path("mosaic_config.yaml"),
    force: Annotated[bool, typer.Option("--force", help="Replace the file if it exists.")] = False,
) -> None:
    """Write a commented file to start from. Only its owner can read it, because it may hold the robot's token."""
    from mosaic_core.cli.configuration.config_template import config_template
    from mosaic_core.runtime.configuration.resolver import ConnectorResolver

    text = config_template({one.type for one in ConnectorResolver().types()})
    flags = os.O_WRONLY | os.O_CREAT | (os.O_TRUNC if force else os.O_EXCL)
    try:
        with os.fdopen(os.open(path, flags, 0o600), "w", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        usage(f"{path} exists; --force replaces it")
    except OSError as error:
        usage(f"{path} can't be written: {error.strerror}")
    typer.echo(f"wrote {path}; next:\n  export MOSAIC_ROBOT_ID=… MOSAIC_TOKEN=…   # as your server shows them")
    typer.echo(f"  mosaic validate {path}\n  mosaic run {path}")
