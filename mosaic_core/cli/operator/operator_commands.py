"""``mosaic operator``: what somebody at a terminal may ask of robots, and how they command one."""

from __future__ import annotations

from functools import partial
from typing import Annotated

import typer

from mosaic_core.cli.operator.account_options import Work, app, command
from mosaic_core.words.data_type import MosaicDataType
from mosaic_core.words.errors import ConnectionFailed, hint_at, whole_sentence
from mosaic_core.words.original_types import ORIGINAL_TYPES

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
AsJson = Annotated[bool, typer.Option("--json", help="One JSON object per line.")]


def checked_data_type(value: str | None) -> str | None:
    """Refuse what is no data type, naming the nearest."""
    if value is not None:
        try:
            MosaicDataType.named(value)
        except ConnectionFailed as error:
            raise typer.BadParameter(f"{whole_sentence(error.message)} {error.cure}") from None
    return value


def drive_types() -> list[str]:
    """The original connector types that take velocities."""
    return [entry.type for entry in ORIGINAL_TYPES.values() if entry.drive is not None]


def checked_drive_type(value: str | None) -> str | None:
    """Refuse what is no such type, naming the nearest."""
    if value is not None and value not in drive_types():
        there_are = f"There are: {', '.join(drive_types())}"
        hint = hint_at(value, drive_types())
        raise typer.BadParameter(f"no original connector type {value!r} takes velocities{hint} {there_are}")
    return value


@command()
def robots(
    announced: Annotated[
        bool, typer.Option("--lan", help="Those that announce themselves on this network instead; needs no account.")
    ] = False,
    as_json: AsJson = False,
) -> Work:
    """List the robots of an account, with their state and connectors."""
    if announced:
        from mosaic_core.cli.operator.lan_robots import list_lan_robots

        list_lan_robots(as_json=as_json)
        raise typer.Exit
    from mosaic_core.cli.operator.operator_session import list_robots

    return partial(list_robots, as_json=as_json)


@app.command()
def pair(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="Its name, id or address; see `robots --lan`.")],
    pin_stdin: Annotated[
        bool, typer.Option("--pin-stdin", help="Read the PIN or code from stdin; else it is asked.")
    ] = False,
    name: Annotated[str, typer.Option(help="What the robot calls this machine; default: its host name.")] = "",
    as_json: AsJson = False,
) -> None:
    """Pair this machine with a robot on its network, by the PIN or the code that the robot shows.

    Afterwards every command finds the robot by its name, id or address, where no account is named.
    """
    from mosaic_core.cli.operator.lan_pairing import pair_robot

    pair_robot(robot, name, pin_stdin=pin_stdin, as_json=as_json)


@app.command()
def unpair(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="Its name, id or address; see `robots --lan`.")],
    as_json: AsJson = False,
) -> None:
    """Forget a paired robot; the robot signs this machine out, if it is reached."""
    from mosaic_core.cli.operator.lan_pairing import unpair_robot

    unpair_robot(robot, as_json=as_json)


@command(has_timeline=True)
def tail(
    robot: RobotArgument,
    label: Label,
    data_type: DataType = None,
    count: Annotated[int | None, typer.Option("-n", "--count", min=1, help="End after so many messages.")] = None,
    as_json: AsJson = False,
) -> Work:
    """Print what a connector sends until Ctrl+C; each second a camera's size and rate, a microphone's level."""
    from mosaic_core.cli.operator.operator_tail import Tail

    return Tail(robot, label, count, as_json, data_type)


@command(is_person=None, has_timeline=True)
def send(
    robot: RobotArgument,
    label: Label,
    data: Annotated[str, typer.Argument(metavar="DATA", help="What to send; JSON for a JSON connector.")],
    data_type: DataType = None,
    rate_hz: Annotated[float, typer.Option(min=0.1, max=200, help="Messages per second, with --for-s.")] = 10.0,
    for_s: Annotated[float, typer.Option(min=0, help="Repeat for so many seconds; 0: send once.")] = 0.0,
    drive_type: DriveType = None,
    as_json: AsJson = False,
) -> Work:
    """Send to a connector, once or repeatedly; takes the lease where the connector wants one, and gives it back.

    The robot enforces its limits; what it refuses is told. Without a terminal it counts as a program, which gives way
    to persons. An original robot would go on with the last command: a drive of it that somebody described, or `--type`
    names, is sent a zero after it, which is said.
    """
    from mosaic_core.cli.operator.operator_send import SendAction

    return SendAction(robot, label, data, 1 / rate_hz, for_s, as_json, data_type, drive_type)


@command(is_person=None, has_timeline=True, interrupted="the request was taken back: no answer had come")
def call(
    robot: RobotArgument,
    label: Label,
    question: Annotated[str, typer.Argument(metavar="JSON", help="The question, such as '{}'.")] = "{}",
    timeout_s: Annotated[
        float | None,
        typer.Option(
            min=0.1, help="How long to wait for the answer.", show_default="as long as the connector may take"
        ),
    ] = None,
    as_json: AsJson = False,
    schema: Annotated[
        bool, typer.Option("--schema", help="Ask nothing: show what may be asked, and what the answer has.")
    ] = False,
) -> Work:
    """Ask a connector that answers requests, and print its answer; progress goes to stderr.

    With --schema it shows the fields of question and answer with their types, bounds and defaults instead; with --json
    both JSON Schemas.

    Takes the lease where the connector wants one, and gives it back. Ctrl+C takes the request back.
    """
    from mosaic_core.cli.operator.operator_call import Call, question_in

    if schema:
        from mosaic_core.cli.operator.request_schema import RequestSchema

        return RequestSchema(robot, label, as_json)
    return Call(robot, label, question_in(question), timeout_s, as_json)


__all__ = ["app"]

Force = Annotated[
    str, typer.Option(metavar="REASON", help="Take it over from whoever has it: supervisors only, with a reason.")
]
WaitS = Annotated[float, typer.Option(min=0, help="How long somebody who commands may take to hand over.")]


@command(is_person=True)
def drive(
    robot: RobotArgument,
    label: Label = "cmd_vel",
    linear_mps: Annotated[float, typer.Option(min=0.01, help="Speed of the keys forward and back.")] = 0.3,
    angular_radps: Annotated[float, typer.Option(min=0.01, help="Speed of the keys left and right.")] = 0.8,
    force: Force = "",
    wait_s: WaitS = 30.0,
    drive_type: DriveType = None,
    as_json: AsJson = False,
) -> Work:
    """Drive with the keyboard: arrows or WASD to move, space to stand, x or Esc to stop the robot, q to leave.

    C clears a stop, G hands over to whoever asks.

    It moves only while a key is held: without a key repeat for 0.6 s it stands. Takes the lease, gives it back.

    An original robot has neither stop nor lease: there x sends zeros. Where its commands are shares, --linear-mps and
    --angular-radps are shares too: 0.3 is 30 %.
    """
    from mosaic_core.cli.operator.drive_session import DriveSession, need_a_terminal

    need_a_terminal()
    return DriveSession(robot, label, linear_mps, angular_radps, force, wait_s, as_json, drive_type)


@command(is_person=True)
def stop(
    robot: RobotArgument,
    reason: Annotated[str, typer.Option(help="Why; everybody who is connected reads it.")] = "",
    drive_label: Annotated[
        str, typer.Option("--drive", metavar="LABEL", help="Of an original robot: also send zeros to this drive.")
    ] = "",
    drive_type: DriveType = None,
    as_json: AsJson = False,
) -> Work:
    """Stop a robot: it stands, and takes no command until it is cleared. Needs no lease.

    Software, and it has to sign in and connect first: this is no certified emergency stop. An original robot has no
    stop: what is known to drive it is sent zeros, which is said, and the exit code is 1.
    """
    from mosaic_core.cli.operator.control_actions import stop_robot

    return lambda operator: stop_robot(operator, robot, reason, drive_label, drive_type, as_json=as_json)


@command(is_person=None)
def clear(robot: RobotArgument, as_json: AsJson = False) -> Work:
    """Clear the stop of a robot, so that commands act again. Look at the robot first.

    Only a person clears a stop. Without a terminal it counts as a program, as an account made by `--program` always
    does, and is refused. Whoever sent on through the stop lets go first: by a zero, or a pause as long as the time-out.
    """
    from mosaic_core.cli.operator.control_actions import clear_stop

    return partial(clear_stop, robot=robot, as_json=as_json)


@command(is_person=True)
def stop_right(
    robot: RobotArgument,
    who: Annotated[str, typer.Argument(metavar="OBSERVER", help="Name or peer id of an observer who is connected.")],
    give_back: Annotated[bool, typer.Option("--give-back", help="Let it say stop again.")] = False,
    as_json: AsJson = False,
) -> Work:
    """Take from one observer the right to say stop, until a supervisor gives it back. Supervisors only.

    Everybody who is connected is told, and the journal keeps it. Operators and supervisors may always say stop.
    """
    from mosaic_core.cli.operator.control_actions import change_stop_right

    return partial(change_stop_right, robot=robot, who=who, may_stop=give_back, as_json=as_json)


@command(is_person=True)
def lease(
    robot: RobotArgument,
    resource: Annotated[
        str, typer.Option(help="Which of the robot's resources; without it all are shown, and motion is taken.")
    ] = "",
    take: Annotated[bool, typer.Option("--take", help="Take it, and hold it until Ctrl+C.")] = False,
    force: Force = "",
    release: Annotated[
        bool, typer.Option("--release", help="Free it: take it, by --force if need be, and give it back at once.")
    ] = False,
    wait_s: WaitS = 30.0,
    as_json: AsJson = False,
) -> Work:
    """Show who commands a robot; with --take, --force or --release, change that."""
    from mosaic_core.cli.operator.control_actions import show_leases, take_lease

    if not (take or force or release):
        return partial(show_leases, robot=robot, resource=resource, as_json=as_json)
    wanted = resource or "motion"
    return lambda operator: take_lease(operator, robot, wanted, force, wait_s, releases=release, as_json=as_json)


@command(is_person=True)
def journal(
    robot: RobotArgument,
    limit: Annotated[int, typer.Option("-n", "--limit", min=1, max=200, help="The newest so many entries.")] = 50,
    as_json: AsJson = False,
) -> Work:
    """Show what happened on a robot: leases, stops, refused commands. Supervisors only."""
    from mosaic_core.cli.operator.control_actions import show_journal

    return partial(show_journal, robot=robot, limit=limit, as_json=as_json)
