"""``mosaic operator``: quick looks at robots from a terminal."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

app = typer.Typer(no_args_is_help=True, help="Look at robots, and command them, from the terminal.")

Server = Annotated[str, typer.Option(envvar="MOSAIC_SERVER", help="The server's address.")]
Email = Annotated[str, typer.Option(envvar="MOSAIC_EMAIL", help="The account to sign in with.")]
PasswordStdin = Annotated[
    bool, typer.Option("--password-stdin", help="Read the password from stdin; else MOSAIC_PASSWORD, else it is asked.")
]
Code = Annotated[str, typer.Option(help="A one-time sign-in code instead of account and password.")]
RobotArgument = Annotated[str, typer.Argument(metavar="ROBOT", help="The robot's id or name.")]
Label = Annotated[str, typer.Argument(metavar="LABEL", help="The connector's label.")]
Timeline = Annotated[bool, typer.Option("--timeline", help="At the end, show how the connection came up.")]
AsJson = Annotated[bool, typer.Option("--json", help="One JSON object per line.")]

DEFAULT_SERVER = "http://127.0.0.1:9001"


@app.command()
def robots(
    server: Server = DEFAULT_SERVER,
    email: Email = "",
    password_stdin: PasswordStdin = False,
    code: Code = "",
    as_json: AsJson = False,
) -> None:
    """List the robots of an account, with their state and connectors."""
    from mosaic_core.cli import operator_session as session

    sign_in = session.SignIn.asked(server, email, code, password_stdin=password_stdin)
    raise typer.Exit(session.run(sign_in, lambda operator: session.list_robots(operator, as_json=as_json)))


@app.command()
def tail(
    robot: RobotArgument,
    label: Label,
    server: Server = DEFAULT_SERVER,
    email: Email = "",
    password_stdin: PasswordStdin = False,
    code: Code = "",
    count: Annotated[int | None, typer.Option("-n", "--count", min=1, help="End after so many messages.")] = None,
    as_json: AsJson = False,
    timeline: Timeline = False,
) -> None:
    """Print what a connector sends until Ctrl+C; each second a camera's size and rate, a microphone's level."""
    from mosaic_core.cli import operator_session as session
    from mosaic_core.cli.operator_tail import Tail

    sign_in = session.SignIn.asked(server, email, code, password_stdin=password_stdin)
    raise typer.Exit(session.run(sign_in, Tail(robot, label, count, as_json), shows_timeline=timeline))


@app.command()
def send(
    robot: RobotArgument,
    label: Label,
    data: Annotated[str, typer.Argument(metavar="DATA", help="What to send; JSON for a JSON connector.")],
    server: Server = DEFAULT_SERVER,
    email: Email = "",
    password_stdin: PasswordStdin = False,
    code: Code = "",
    rate_hz: Annotated[float, typer.Option(min=0.1, max=200, help="Messages per second, with --for-s.")] = 10.0,
    for_s: Annotated[float, typer.Option(min=0, help="Repeat for so many seconds; 0: send once.")] = 0.0,
    as_json: AsJson = False,
    timeline: Timeline = False,
) -> None:
    """Send to a connector, once or repeatedly; takes the lease where the connector wants one, and gives it back.

    The robot enforces its limits; what it refuses is told. Without a terminal it counts as a program, which gives way
    to persons.
    """
    from mosaic_core.cli import operator_session as session
    from mosaic_core.cli.operator_send import Send

    sign_in = session.SignIn.asked(server, email, code, password_stdin=password_stdin)
    work = Send(robot, label, data, 1 / rate_hz, for_s, as_json)
    raise typer.Exit(session.run(sign_in, work, is_person=sys.stdin.isatty(), shows_timeline=timeline))
