"""``mosaic server robot grant``, ``revoke`` and ``grants``: roles on one robot."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from mosaic_server.cli.options import (
    AsJson,
    DatabaseUrl,
    DataDir,
    fail,
    known_person,
    nearest,
    opened,
    role_refusals,
    show,
    show_table,
)
from mosaic_server.cli.robot import RobotIdOrName, known_robot
from mosaic_server.roles import Role

if TYPE_CHECKING:
    from mosaic_server.storage.grants import RoleOnRobot

Email = Annotated[str, typer.Argument(help="The account's e-mail.")]
_ALL = 1_000_000


def grant(
    robot: RobotIdOrName,
    email: Email,
    role: Annotated[str, typer.Argument(help="observer, operator or supervisor.")],
    data_dir: DataDir = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Give an account a role on a robot; a running server closes its connections there within seconds."""
    _change(robot, email, role_named(role), data_dir, database, as_json)


def revoke(
    robot: RobotIdOrName,
    email: Email,
    data_dir: DataDir = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Take a granted role back: the account's default counts again."""
    _change(robot, email, None, data_dir, database, as_json)


def grants(
    robot: RobotIdOrName,
    data_dir: DataDir = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """List the accounts of the robot's organization with their roles on it."""
    from mosaic_server.storage.grants import roles_on_robot

    with opened(data_dir, database) as db:
        found, _ = db.work(roles_on_robot, known_robot(db, robot).id, 0, _ALL)
    show_table([_row(one) for one in found], as_json=as_json)


def role_named(role: str) -> Role:
    """The role, or the end with the nearest one."""
    if role not in list(Role):
        guess = nearest(role, Role)
        fail(f"no role {role!r}{guess or '; there are ' + ', '.join(Role)}", exit_code=2)
    return Role(role)


def _change(robot: str, email: str, role: Role | None, data_dir: DataDir, database: DatabaseUrl, as_json: bool) -> None:
    from mosaic_server.storage.grants import BY_COMMAND, set_role

    with opened(data_dir, database) as db:
        known = known_robot(db, robot)
        person = known_person(db, email)
        with role_refusals():
            changed = db.work(set_role, known.id, person.id, role, BY_COMMAND)
    how = "" if role else " by default"
    now = f"{changed.email} is {changed.standing.role_if_active.value} on {known.name}{how}"
    show({"robotId": known.id, "robot": known.name, **_row(changed)}, as_json=as_json, text=now)


def _row(one: RoleOnRobot) -> dict[str, str | bool]:
    return {
        "email": one.email,
        "role": one.standing.role_if_active.value,
        "granted": one.standing.granted is not None,
        "program": one.standing.is_program,
        "admin": one.standing.is_organization_admin,
        "active": one.standing.is_active,
        "accountId": one.account_id,
    }
