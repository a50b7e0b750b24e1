"""``mosaic server user …``"""

from __future__ import annotations

from typing import Annotated

import typer

from mosaic_server.cli.options import (
    BY_COMMAND,
    AsJson,
    DatabaseUrl,
    DataDir,
    PasswordStdin,
    chosen_password,
    fail,
    opened,
    show,
    show_table,
)
from mosaic_server.rest.envelope import iso_time
from mosaic_server.storage.accounts import (
    AccountExists,
    Person,
    add_account,
    all_people,
    change_password,
    person_by_email,
)
from mosaic_server.storage.database import Database
from mosaic_server.storage.members import shut_out

app = typer.Typer(help="Accounts of operators.", no_args_is_help=True)
Email = Annotated[str, typer.Argument(help="The account's e-mail.")]


@app.command("add")
def add(
    email: Email,
    full_name: Annotated[str, typer.Option(help="What robots and other operators see.")] = "",
    password_stdin: PasswordStdin = False,
    data_dir: DataDir = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Add an account with an organization of its own; a generated password is shown once."""
    password, generated = chosen_password(password_stdin)
    with opened(data_dir, database) as db:
        try:
            person = db.work(add_account, email, password, full_name)
        except AccountExists as error:
            fail(str(error))
    _show_password(person, password if generated else None, as_json)


@app.command("list")
def show_all(data_dir: DataDir = None, database: DatabaseUrl = None, as_json: AsJson = False) -> None:
    """List all accounts."""
    with opened(data_dir, database) as db:
        people = db.work(all_people)
    rows = [
        {
            "email": person.email,
            "id": person.id,
            "active": person.is_active,
            "admin": person.is_organization_admin,
            "created": iso_time(person.created_at_ms),
        }
        for person in people
    ]
    show_table(rows, as_json=as_json)


@app.command("password")
def password(
    email: Email,
    password_stdin: PasswordStdin = False,
    data_dir: DataDir = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Set a new password; the account is logged out everywhere."""
    new, generated = chosen_password(password_stdin)
    with opened(data_dir, database) as db:
        person = _known(db, email)
        db.work(change_password, person.id, new)
    _show_password(person, new if generated else None, as_json)


@app.command("disable")
def disable(
    email: Email,
    undo: Annotated[bool, typer.Option("--undo", help="Enable it again.")] = False,
    data_dir: DataDir = None,
    database: DatabaseUrl = None,
) -> None:
    """Shut an account out; a running server closes its sockets within seconds."""
    with opened(data_dir, database) as db:
        db.work(shut_out, _known(db, email).id, undo, BY_COMMAND)
    typer.echo(f"{email} is {'enabled' if undo else 'disabled'}")


def _known(db: Database, email: str) -> Person:
    person = db.work(person_by_email, email)
    if person is None:
        fail(f"no account {email!r}; see `mosaic server user list`")
    return person


def _show_password(person: Person, generated: str | None, as_json: bool) -> None:
    record = {"email": person.email, "id": person.id, **({"password": generated} if generated else {})}
    shown = f"\npassword: {generated}   (shown this once)" if generated else ""
    show(record, as_json=as_json, text=f"account:  {person.email}{shown}")
