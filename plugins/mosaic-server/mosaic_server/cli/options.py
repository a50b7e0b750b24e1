"""Options and endings that the commands share.

No module of commands imports database or web server before a command runs: ``--help`` needs neither.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

if TYPE_CHECKING:
    from mosaic_server.storage.accounts import Person
    from mosaic_server.storage.database import Database

DataDir = Annotated[
    Path | None,
    typer.Option(help="Where the SQLite file lives; default: MOSAIC_DATA_DIR or the user's data directory."),
]
DatabaseUrl = Annotated[
    str | None, typer.Option("--database", help="SQLAlchemy URL, e.g. postgresql+psycopg://…; default: SQLite.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON for programs.")]
PasswordStdin = Annotated[bool, typer.Option(help="Read the password from standard input instead of making one.")]

_WIDE = 1000
"""Ids and names are pasted and rows are searched: a narrow terminal may wrap lines, nothing is cut."""


def fail(message: str, *, exit_code: int = 1) -> NoReturn:
    """End with a message on standard error."""
    typer.echo(f"error: {message}", err=True)
    raise typer.Exit(exit_code)


def checked_email(email: str) -> str:
    """``email``, or the end where it is none."""
    from mosaic_server.rest.texts import EMAIL

    if re.fullmatch(EMAIL, email.strip()) is None:
        fail(f"{email!r} is no e-mail: expected one such as ada@example.org", exit_code=2)
    return email


@contextmanager
def opened(data_dir: Path | None, url: str | None) -> Iterator[Database]:
    """The database, with the newest schema."""
    from sqlalchemy.exc import ArgumentError, NoSuchModuleError, SQLAlchemyError

    from mosaic_server.data_dir import default_data_dir
    from mosaic_server.storage.database import Database

    try:
        database = Database(data_dir or default_data_dir(), url)
    except (ArgumentError, NoSuchModuleError, ModuleNotFoundError) as error:
        fail(f"--database: {error}", exit_code=2)
    except OSError as error:
        fail(f"the data directory can't be used: {error}; name a folder that you may write", exit_code=2)
    try:
        database.migrate()
        yield database
    except SQLAlchemyError as error:
        fail(f"the database does not answer: {error}")
    finally:
        database.close()


def chosen_password(from_stdin: bool) -> tuple[str, bool]:
    """A password and whether it was generated (and has to be shown)."""
    from mosaic_server.security.passwords import MIN_PASSWORD_LENGTH, new_password

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
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, pad_edge=False, header_style="bold", padding=(0, 2, 0, 0))
    for name in rows[0]:
        table.add_column(name, no_wrap=True)
    for row in rows:
        table.add_row(*(Text(_cell(value)) for value in row.values()))
    Console(highlight=False, width=_WIDE).print(table)


def _cell(value: Any) -> str:
    return "" if value is None else ("yes" if value else "no") if isinstance(value, bool) else str(value)


def nearest(word: str, known: Iterable[str]) -> str:
    """``; did you mean 'x'?`` for an error about a name that isn't known, or nothing."""
    by_lower = {name.lower(): name for name in known}
    found = get_close_matches(word.lower(), by_lower, n=1, cutoff=0.6)
    return f"; did you mean '{by_lower[found[0]]}'?" if found else ""


def known_person(db: Database, email: str) -> Person:
    """The account, or the end with the nearest e-mail."""
    from mosaic_server.storage.accounts import all_people, person_by_email

    person = db.work(person_by_email, email)
    if person is None:
        guess = nearest(email, [one.email for one in db.work(all_people)])
        fail(f"no account {email!r}{guess or '; see `mosaic server user list`'}")
    return person


def chosen_organization(db: Database, email: str, option: str) -> str:
    """The id of the organization of that account; without one, of the only organization there is."""
    from mosaic_server.storage.accounts import all_people

    if email:
        return known_person(db, email).organization_id
    organizations = {person.organization_id for person in db.work(all_people)}
    if not organizations:
        fail("there is no account yet; make one with `mosaic server init`", exit_code=2)
    if len(organizations) > 1:
        fail(f"there are several organizations; name an account of the one you mean with {option} EMAIL", exit_code=2)
    return organizations.pop()


@contextmanager
def role_refusals() -> Iterator[None]:
    """Ends with a sentence where a change of roles is refused."""
    from mosaic_server.storage.grants import LastAdministrator, LastSupervisor, UnknownAccount

    try:
        yield
    except LastSupervisor as error:
        fail(f"robot {str(error)!r} would be left without a supervisor; make somebody else one first")
    except LastAdministrator:
        fail("the organization would be left without an administrator; make somebody else one first")
    except UnknownAccount:
        fail("the account belongs to another organization than the robot; add one with `--organization-of`")
