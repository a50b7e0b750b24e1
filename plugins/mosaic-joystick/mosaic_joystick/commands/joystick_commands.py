"""``mosaic joystick``: which sticks there are, and driving by one."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mosaic_core.cli.operator.account_options import Work, command

if TYPE_CHECKING:
    from mosaic_joystick.stick_state import Stick

app = typer.Typer(add_completion=False, no_args_is_help=True, help="Joysticks, gamepads and 3D mice of this machine.")

AsJson = Annotated[bool, typer.Option("--json", help="One JSON object per line.")]


@app.command("list")
def list_sticks(as_json: AsJson = False) -> None:
    """Show the sticks that are plugged in, with the names of their axes and buttons."""
    from mosaic_joystick.sticks import found_sticks, unreadable

    found = list(found_sticks())
    for stick in found:
        typer.echo(json.dumps(described(stick), ensure_ascii=False) if as_json else in_words(stick))
    if not (found or as_json):
        typer.echo("no stick is plugged in")
    if shut := unreadable():
        typer.echo(f"{len(shut)} input devices may not be read: sudo usermod -aG input $USER, log in again", err=True)


def described(stick: Stick) -> dict[str, Any]:
    axes, buttons = [axis.name for axis in stick.axes], list(stick.buttons.values())
    return {"name": stick.name, "path": stick.path, "kind": stick.kind, "axes": axes, "buttons": buttons}


def in_words(stick: Stick) -> str:
    """Three lines: its names are for the options, and must not be cut off."""
    its = described(stick)
    lines = (f"{key}: {' '.join(its[key]) or 'none'}" for key in ("axes", "buttons"))
    return "\n  ".join([f"{stick.name} ({stick.kind}) {stick.path}", *lines])


@command(group=app, is_person=True)
def drive(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="The robot's id or name.")],
    label: Annotated[str, typer.Argument(metavar="LABEL", help="The connector that takes Twist.")] = "cmd_vel",
    stick: Annotated[str, typer.Option(help="`any`, a part of its name, its path, or `fake`.")] = "any",
    dead_man: Annotated[str, typer.Option(metavar="BUTTON", help="Held while driving; none: the usual one.")] = "",
    ahead: Annotated[str, typer.Option(metavar="AXIS", help="Drives ahead and back; none: y.")] = "",
    turn: Annotated[str, typer.Option(metavar="AXIS", help="Turns; none: rz, of a gamepad x.")] = "",
    left: Annotated[str, typer.Option(metavar="AXIS", help="Drives sideways; none: nothing does.")] = "",
    linear_mps: Annotated[float, typer.Option(min=0.01, help="Speed with the stick pushed to its end.")] = 0.3,
    angular_radps: Annotated[float, typer.Option(min=0.01, help="The same of turning.")] = 0.8,
    dead_zone_percent: Annotated[float, typer.Option(min=0, max=50, help="Of each axis is taken for 0.")] = 8.0,
    force: Annotated[
        str, typer.Option(metavar="REASON", help="Whoever drives gives way when the button is held: supervisors only.")
    ] = "",
    wait_s: Annotated[float, typer.Option(min=0, max=30, help="How long who drives may take to hand over.")] = 5.0,
    as_json: AsJson = False,
) -> Work:
    """Drive with a stick, while its dead man's button is held: let it go, and the robot stands and is free for others.

    It is an operator like any other, with the same lease, limits and stop, also on the robot's own computer.
    """
    from mosaic_joystick.commands.drive_session import StickDrive
    from mosaic_joystick.commands.stick_mapping import Wishes

    wishes = Wishes(ahead, turn, left, dead_man, linear_mps, angular_radps)
    return StickDrive(robot, label, stick, dead_zone_percent / 100, wishes, force, wait_s, as_json)
