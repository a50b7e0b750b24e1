"""Options and endings that the commands share."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
from sqlalchemy.exc import ArgumentError, NoSuchModuleError, SQLAlchemyError

from mosaic_server.security.passwords import MIN_PASSWORD_LENGTH, new_password
from mosaic_server.storage.audit import COMMAND_LINE
from mosaic_server.storage.database import Database, default_data_dir
from mosaic_server.storage.grants import Actor

DataDir = Annotated[
    Path | None,
    typer.Option(help="Where the SQLite file lives; default: MOSAIC_DATA_DIR or the user's data directory."),
]
DatabaseUrl = Annotated[
    str | None, typer.Option("--database", help="SQLAlchemy URL, e.g. postgresql+psycopg://…; default: SQLite.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON for programs.")]
PasswordStdin = Annotated[bool, typer.Option(help="Read the password from standard input instead of making one.")]

BY_COMMAND = Actor(COMMAND_LINE)
"""Who does what the commands do, in the audit log."""


def fail(message: str, *, exit_code: int = 1) -> NoReturn:
    """End with a message on standard error."""
    typer.echo(f"error: {message}", err=True)
    raise typer.Exit(exit_code)


@contextmanager
def opened(data_dir: Path | None, url: str | None) -> Iterator[Database]:
    """The database, with the newest schema."""
    try:
        database = Database(data_dir or default_data_dir(), url)
    except (ArgumentError, NoSuchModuleError, ModuleNotFoundError) as error:
        fail(f"--database: {error}", exit_code=2)
    except OSError as error:
        fail(f"the data directory can't be used: {error}", exit_code=2)
    try:
        database.migrate()
        yield database
    except SQLAlchemyError as error:
        fail(f"the database does not answer: {error}")
    finally:
        database.close()


def chosen_password(from_stdin: bool) -> tuple[str, bool]:
    """A password and whether it was generated (and has to be shown)."""
    if not from_stdin:
        return new_password(), True
    password = sys.stdin.readline().rstrip("\r\n")
    if len(password) < MIN_PASSWORD_LENGTH:
        fail(f"a password has at least {MIN_PASSWORD_LENGTH} characters", exit_code=2)
    return password, False


def show(record: Mapping[str, Any], *, as_json: bool, text: str) -> None:
    typer.echo(json.dumps(record) if as_json else text)


def show_table(rows: Sequence[Mapping[str, Any]], *, as_json: bool) -> None:
    """Rows with the same keys, aligned for people or as a JSON array."""
    if as_json:
        typer.echo(json.dumps(list(rows)))
        return
    if not rows:
        typer.echo("none")
        return
    lines = [list(rows[0]), *([str(value) for value in row.values()] for row in rows)]
    widths = [max(len(line[column]) for line in lines) for column in range(len(lines[0]))]
    for line in lines:
        typer.echo("  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip())
