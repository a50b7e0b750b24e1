"""``mosaic operator``: quick looks at robots from a terminal."""

from __future__ import annotations

import sys
from functools import partial
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from mosaic_core.words.data_type import MosaicDataType
from mosaic_core.words.errors import ConnectionFailed, hint_at
from mosaic_core.words.original_types import ORIGINAL_TYPES

if TYPE_CHECKING:
    from mosaic_core.cli.operator.operator_session import Work

app = typer.Typer(
    add_completion=False, no_args_is_help=True, help="Look at robots, and command them, from the terminal."
)

Server = Annotated[str, typer.Option(envvar="MOSAIC_SERVER", help="The server's address.")]
Email = Annotated[str, typer.Option(envvar="MOSAIC_EMAIL", help="The account to sign in with.")]
PasswordStdin = Annotated[
    bool, typer.Option("--password-stdin", help="Read the password from stdin; else MOSAIC_PASSWORD, else it is asked.")
]
Code = Annotated[str, typer.Option(help="A one-time sign-in code instead of account and password.")]
RobotArgument = Annotated[str, typer.Argument(metavar="ROBOT", help="The robot's id or name.")]
Label = Annotated[str, typer.Argument(metavar="LABEL", help="The connector's label.")]
DataType = Annotated[
    str | None,
    typer.Option(
        "--data-type",
        callback=lambda value: checked_data_type(value),
        autocompletion=lambda: [str(one) for one in MosaicDataType],
        help="What travels there, where an original robot's connector is not described: json-r2u, media, …",
    ),
]
DriveType = Annotated[
    str | None,
    typer.Option(
        "--type",
        callback=lambda value: checked_drive_type(value),
        autocompletion=lambda: drive_types(),
        help="Of an original robot whose drive nobody has described: its connector type in the robot's YAML file.",
    ),
]
Timeline = Annotated[bool, typer.Option("--timeline", help="At the end, show how the connection came up.")]
AsJson = Annotated[bool, typer.Option("--json", help="One JSON object per line.")]


def checked_data_type(value: str | None) -> str | None:
    """Refuse what is no data type, naming the nearest."""
    if value is not None:
        try:
            MosaicDataType.named(value)
        except ConnectionFailed as error:
            raise typer.BadParameter(f"{error.message} {error.cure}") from None
    return value


def drive_types() -> list[str]:
    """The original connector types that take velocities."""
    return [entry.type for entry in ORIGINAL_TYPES.values() if entry.drive is not None]


def checked_drive_type(value: str | None) -> str | None:
    """Refuse what is no such type, naming the nearest."""
    if value is not None and value not in drive_types():
        hint = hint_at(value, drive_types())
        raise typer.BadParameter(f"no original connector type {value!r} takes velocities{hint} {_known_drives()}")
    return value


def _known_drives() -> str:
    return f"There are: {', '.join(drive_types())}"


DEFAULT_SERVER = "http://127.0.0.1:9001"


def signed_in(
    work: Work,
    server: str,
    email: str,
    code: str,
    *,
    password_stdin: bool,
    is_person: bool = False,
    shows_timeline: bool = False,
) -> NoReturn:
    """Do ``work`` between signing in and signing off, and end with its exit code."""
    from mosaic_core.cli.operator import operator_session as session  # loads WebRTC: only for who does something

    sign_in = session.SignIn.asked(server, email, code, password_stdin=password_stdin)
    raise typer.Exit(session.run(sign_in, work, is_person=is_person, shows_timeline=shows_timeline))


@app.command()
def robots(
    server: Server = DEFAULT_SERVER,
    email: Email = "",
    password_stdin: PasswordStdin = False,
    code: Code = "",
    as_json: AsJson = False,
) -> None:
    """List the robots of an account, with their state and connectors."""
    from mosaic_core.cli.operator.operator_session import list_robots

    signed_in(partial(list_robots, as_json=as_json), server, email, code, password_stdin=password_stdin)


@app.command()
def tail(
    robot: RobotArgument,
    label: Label,
    server: Server = DEFAULT_SERVER,
    email: Email = "",
    password_stdin: PasswordStdin = False,
    code: Code = "",
    data_type: DataType = None,
    count: Annotated[int | None, typer.Option("-n", "--count", min=1, help="End after so many messages.")] = None,
    as_json: AsJson = False,
    timeline: Timeline = False,
) -> None:
    """Print what a connector sends until Ctrl+C; each second a camera's size and rate, a microphone's level."""
    from mosaic_core.cli.operator.operator_tail import Tail

    work = Tail(robot, label, count, as_json, data_type)
    signed_in(work, server, email, code, password_stdin=password_stdin, shows_timeline=timeline)


@app.command()
def send(
    robot: RobotArgument,
    label: Label,
    data: Annotated[str, typer.Argument(metavar="DATA", help="What to send; JSON for a JSON connector.")],
    server: Server = DEFAULT_SERVER,
    email: Email = "",
    password_stdin: PasswordStdin = False,
    code: Code = "",
    data_type: DataType = None,
    rate_hz: Annotated[float, typer.Option(min=0.1, max=200, help="Messages per second, with --for-s.")] = 10.0,
    for_s: Annotated[float, typer.Option(min=0, help="Repeat for so many seconds; 0: send once.")] = 0.0,
    drive_type: DriveType = None,
    as_json: AsJson = False,
    timeline: Timeline = False,
) -> None:
    """Send to a connector, once or repeatedly; takes the lease where the connector wants one, and gives it back.

    The robot enforces its limits; what it refuses is told. Without a terminal it counts as a program, which gives way
    to persons. An original robot would go on with the last command: a drive of it that somebody described, or `--type`
    names, is sent a zero after it, which is said.
    """
    from mosaic_core.cli.operator.operator_send import SendAction

    work = SendAction(robot, label, data, 1 / rate_hz, for_s, as_json, data_type, drive_type)
    is_person = sys.stdin.isatty()
    signed_in(work, server, email, code, password_stdin=password_stdin, is_person=is_person, shows_timeline=timeline)
