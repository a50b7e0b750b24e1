"""``mosaic operator drive``, ``stop``, ``clear``, ``lease`` and ``journal``: somebody at a terminal commands."""

from __future__ import annotations

from functools import partial
from typing import Annotated

import typer

from mosaic_core.cli.operator.account_options import Work, app, command
from mosaic_core.cli.operator.operator_commands import AsJson, DriveType, Label, RobotArgument

__all__ = ["app"]

Resource = Annotated[str, typer.Option(help="Which of the robot's resources.")]
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


@command(is_person=True)
def clear(robot: RobotArgument, as_json: AsJson = False) -> Work:
    """Clear the stop of a robot, so that commands act again. Look at the robot first."""
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
    resource: Resource = "motion",
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
        return partial(show_leases, robot=robot, as_json=as_json)
    return lambda operator: take_lease(operator, robot, resource, force, wait_s, releases=release, as_json=as_json)


@command(is_person=True)
def journal(
    robot: RobotArgument,
    limit: Annotated[int, typer.Option("-n", "--limit", min=1, max=200, help="The newest so many entries.")] = 50,
    as_json: AsJson = False,
) -> Work:
    """Show what happened on a robot: leases, stops, refused commands. Supervisors only."""
    from mosaic_core.cli.operator.control_actions import show_journal

    return partial(show_journal, robot=robot, limit=limit, as_json=as_json)
