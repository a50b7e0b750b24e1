"""``mosaic server robot …``"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from mosaic_server.cli.options import (
    AsJson,
    DatabaseUrl,
    DataDir,
    chosen_organization,
    fail,
    nearest,
    opened,
    show,
    show_table,
)

if TYPE_CHECKING:
    from mosaic_server.storage.database import Database
    from mosaic_server.storage.robots import RobotRecord

app = typer.Typer(help="Robots and their tokens.", no_args_is_help=True)
RobotIdOrName = Annotated[str, typer.Argument(help="The robot's id, or its name where that is unique.")]
ServerUrl = Annotated[str, typer.Option(help="How the robot reaches this server; for the snippet to paste.")]

DEFAULT_URL = "ws://127.0.0.1:9001"


@app.command("add")
def add(
    name: Annotated[str, typer.Argument(help="What people call the robot.")],
    owner: Annotated[
        str, typer.Option(help="E-mail of an account of its organization; needed if there are several.")
    ] = "",
    description: Annotated[str, typer.Option(help="Shown in the dashboard.")] = "",
    no_authorization: Annotated[
        bool,
        typer.Option("--no-authorization", help="Let anybody who knows the id be this robot. For closed networks."),
    ] = False,
    ws_url: ServerUrl = DEFAULT_URL,
    data_dir: DataDir = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Add a robot; prints what belongs into its YAML file, with the token shown once."""
    from mosaic_server.storage.robots import RobotAuthType, add_robot, all_robots, renew_token

    auth_type = RobotAuthType.NO_AUTHORIZATION if no_authorization else RobotAuthType.SIMPLE_TOKEN
    with opened(data_dir, database) as db:
        organization = chosen_organization(db, owner, "--owner")
        is_taken = any((one.organization_id, one.name) == (organization, name) for one in db.work(all_robots))
        robot = db.work(add_robot, organization, name, description, auth_type)
        token = None if no_authorization else db.work(renew_token, robot.id)
    if is_taken:
        typer.echo(f"hint: another robot of this organization is called {name!r}: commands then need the id", err=True)
    _show_robot(robot, token, ws_url, as_json)


@app.command("list")
def show_all(data_dir: DataDir = None, database: DatabaseUrl = None, as_json: AsJson = False) -> None:
    """List all robots."""
    from mosaic_server.storage.robots import all_robots

    with opened(data_dir, database) as db:
        robots = db.work(all_robots)
    rows = [
        {"name": robot.name, "id": robot.id, "auth": _auth_name(robot), "token": "yes" if robot.has_token else "no"}
        for robot in robots
    ]
    show_table(rows, as_json=as_json)


@app.command("token")
def token(
    robot: RobotIdOrName,
    ws_url: ServerUrl = DEFAULT_URL,
    data_dir: DataDir = None,
    database: DatabaseUrl = None,
    as_json: AsJson = False,
) -> None:
    """Make a new token; the old one is refused from now on."""
    from mosaic_server.storage.robots import RobotAuthType, renew_token

    with opened(data_dir, database) as db:
        known = known_robot(db, robot)
        if known.auth_type is not RobotAuthType.SIMPLE_TOKEN:
            fail(f"robot {known.name!r} needs no token", exit_code=2)
        new = db.work(renew_token, known.id)
    _show_robot(known, new, ws_url, as_json)


@app.command("remove")
def remove(robot: RobotIdOrName, data_dir: DataDir = None, database: DatabaseUrl = None) -> None:
    """Remove a robot and its token."""
    from mosaic_server.storage.robots import remove_robot

    with opened(data_dir, database) as db:
        known = known_robot(db, robot)
        db.work(remove_robot, known.id)
    typer.echo(f"removed {known.name} ({known.id})")


def known_robot(db: Database, id_or_name: str) -> RobotRecord:
    """The robot, or the end with the nearest name."""
    from mosaic_server.storage.robots import all_robots, robot_by_id

    by_id = db.work(robot_by_id, id_or_name.lower())
    if by_id is not None:
        return by_id
    robots = db.work(all_robots)
    named = [robot for robot in robots if robot.name == id_or_name]
    if len(named) > 1:
        fail(f"{len(named)} robots are called {id_or_name!r}; use the id", exit_code=2)
    if not named:
        guess = nearest(id_or_name, [robot.name for robot in robots])
        fail(f"no robot {id_or_name!r}{guess or '; see `mosaic server robot list`'}")
    return named[0]


def _auth_name(robot: RobotRecord) -> str:
    return robot.auth_type.name.lower().replace("_", "-")


def _show_robot(robot: RobotRecord, token: str | None, ws_url: str, as_json: bool) -> None:
    record = {"robotId": robot.id, "name": robot.name, **({"robotToken": token} if token else {})}
    show(record, as_json=as_json, text=yaml_snippet(robot, token, ws_url))


def yaml_snippet(robot: RobotRecord, token: str | None, ws_url: str) -> str:
    """The ``server:`` part of the robot's file."""
    lines = [
        f"# robot {robot.name!r}: put this into its mosaic_config.yaml",
        "server:",
        f"  ws_url: {ws_url.rstrip('/')}",
        "  auth:",
        f"    type: {_auth_name(robot)}",
        f"    robot_id: {robot.id}",
    ]
    if token:
        lines += [
            "    params:",
            f"      token: {token}   # shown this once; or write ${{MOSAIC_TOKEN}} and set that",
        ]
    return "\n".join(lines)
