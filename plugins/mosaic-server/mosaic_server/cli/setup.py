"""``mosaic server init`` and ``seed``: a database with its first account."""

from __future__ import annotations

from typing import Annotated

import typer

from mosaic_server.cli.options import (
    AsJson,
    DatabaseUrl,
    DataDir,
    PasswordStdin,
    checked_email,
    chosen_password,
    fail,
    opened,
    show,
)


def init(
    email: Annotated[str, typer.Option(prompt="E-mail of the first account", help="The first account's e-mail.")],
    password_stdin: PasswordStdin = False,
    data_dir: DataDir = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Make the database and its first account; the generated password is shown once."""
    from mosaic_server.storage.accounts import add_account, count_accounts

    checked_email(email)
    password, generated = chosen_password(password_stdin)
    with opened(data_dir, database) as db:
        if db.work(count_accounts):
            fail("this database has accounts already; add more with `mosaic server user add`", exit_code=2)
        person = db.work(add_account, email, password)
    record = {"email": person.email, **({"password": password} if generated else {})}
    shown = f"\npassword: {password}   (shown this once)" if generated else ""
    show(record, as_json=as_json, text=f"account:  {person.email}{shown}\nNext: mosaic server run")


def seed(
    robot_name: Annotated[str, typer.Option(help="Name of the robot.")] = "robot",
    email: Annotated[str, typer.Option(help="E-mail of the account.")] = "demo@localhost",
    data_dir: DataDir = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Make a throw-away database without asking: one account, one robot, both secrets printed."""
    from mosaic_server.security.passwords import new_password
    from mosaic_server.storage.accounts import add_account, count_accounts
    from mosaic_server.storage.robots import add_robot, renew_token

    password = new_password()
    with opened(data_dir, database) as db:
        if db.work(count_accounts):
            fail("this database is in use; seed only makes new ones", exit_code=2)
        person = db.work(add_account, email, password)
        robot = db.work(add_robot, person.organization_id, robot_name)
        token = db.work(renew_token, robot.id)
    record = {"email": person.email, "password": password, "robotId": robot.id, "robotToken": token}
    show(record, as_json=as_json, text="\n".join(f"{key}: {value}" for key, value in record.items()))
