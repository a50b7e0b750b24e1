"""``mosaic server user …``"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from mosaic_server.cli.options import (
    AsJson,
    DatabaseUrl,
    DataDir,
    PasswordStdin,
    checked_email,
    chosen_password,
    fail,
    known_person,
    opened,
    role_refusals,
    show,
    show_table,
)

if TYPE_CHECKING:
    from mosaic_server.storage.accounts import Person
    from mosaic_server.storage.members import MemberChange

app = typer.Typer(help="Accounts of operators.", no_args_is_help=True)
Email = Annotated[str, typer.Argument(help="The account's e-mail.")]


@app.command("add")
def add(
    email: Email,
    full_name: Annotated[str, typer.Option(help="What robots and other operators see.")] = "",
    organization_of: Annotated[
        str, typer.Option(help="E-mail of an account whose organization it joins; otherwise it gets one of its own.")
    ] = "",
    is_admin: Annotated[
        bool, typer.Option("--admin", help="With --organization-of: it administers that organization.")
    ] = False,
    is_program: Annotated[
        bool, typer.Option("--program", help="A program's account: it can never pass for a person on a robot.")
    ] = False,
    password_stdin: PasswordStdin = False,
    data_dir: DataDir = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Add an account; a generated password is shown once."""
    from mosaic_server.storage.accounts import AccountExists, Membership
    from mosaic_server.storage.grants import BY_COMMAND
    from mosaic_server.storage.members import add_member

    checked_email(email)
    password, generated = chosen_password(password_stdin)
    with opened(data_dir, database) as db:
        membership = None
        if organization_of:
            membership = Membership(known_person(db, organization_of).organization_id, is_admin)
        try:
            person = db.work(add_member, email, password, full_name, membership, is_program, BY_COMMAND)
        except AccountExists as error:
            fail(str(error))
    _show_password(person, password if generated else None, as_json)


@app.command("list")
def show_all(data_dir: DataDir = None, database: DatabaseUrl = None, as_json: AsJson = False) -> None:
    """List all accounts."""
    from mosaic_server.rest.envelope import iso_time
    from mosaic_server.storage.accounts import all_people

    with opened(data_dir, database) as db:
        people = db.work(all_people)
    rows = [
        {
            "email": person.email,
            "id": person.id,
            "active": person.is_active,
            "admin": person.is_organization_admin,
            "program": person.is_program,
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
    from mosaic_server.storage.accounts import change_password

    new, generated = chosen_password(password_stdin)
    with opened(data_dir, database) as db:
        person = known_person(db, email)
        db.work(change_password, person.id, new)
    _show_password(person, new if generated else None, as_json)


@app.command("disable")
def disable(
    email: Email,
    undo: Annotated[bool, typer.Option("--undo", help="Enable it again.")] = False,
    data_dir: DataDir = None,
    database: DatabaseUrl = None,
) -> None:
    """Shut an account out, be it the last supervisor; a running server closes its sockets and connections."""
    from mosaic_server.storage.grants import BY_COMMAND
    from mosaic_server.storage.members import shut_out

    with opened(data_dir, database) as db:
        db.work(shut_out, known_person(db, email).id, undo, BY_COMMAND)
    typer.echo(f"{email} is {'enabled' if undo else 'disabled'}")


@app.command("program")
def program(
    email: Email,
    undo: Annotated[bool, typer.Option("--undo", help="It is a person's again.")] = False,
    data_dir: DataDir = None,
    database: DatabaseUrl = None,
) -> None:
    """Mark an account as a program's: it can never pass for a person on a robot."""
    from mosaic_server.storage.members import MemberChange

    _change(email, MemberChange(is_program=not undo), data_dir, database)
    typer.echo(f"{email} is a {'person' if undo else 'program'}'s account")


@app.command("admin")
def admin(
    email: Email,
    undo: Annotated[bool, typer.Option("--undo", help="It is a plain account again.")] = False,
    data_dir: DataDir = None,
    database: DatabaseUrl = None,
) -> None:
    """Let an account administer its organization."""
    from mosaic_server.storage.members import MemberChange

    _change(email, MemberChange(is_organization_admin=not undo), data_dir, database)
    typer.echo(f"{email} is {'a plain account' if undo else 'an administrator'}")


@app.command("remove")
def remove(email: Email, data_dir: DataDir = None, database: DatabaseUrl = None) -> None:
    """Remove an account and its grants; a running server closes its sockets and connections within seconds."""
    from mosaic_server.storage.grants import BY_COMMAND
    from mosaic_server.storage.members import remove_member

    with opened(data_dir, database) as db, role_refusals():
        db.work(remove_member, known_person(db, email).id, BY_COMMAND)
    typer.echo(f"removed {email}")


def _change(email: str, change: MemberChange, data_dir: DataDir, database: DatabaseUrl) -> None:
    from mosaic_server.storage.grants import BY_COMMAND
    from mosaic_server.storage.members import change_member

    with opened(data_dir, database) as db, role_refusals():
        db.work(change_member, known_person(db, email).id, change, BY_COMMAND)


def _show_password(person: Person, generated: str | None, as_json: bool) -> None:
    record = {"email": person.email, "id": person.id, **({"password": generated} if generated else {})}
    shown = f"\npassword: {generated}   (shown this once)" if generated else ""
    show(record, as_json=as_json, text=f"account:  {person.email}{shown}")
