"""``mosaic operator``: quick looks at robots from a terminal."""

from __future__ import annotations

from functools import partial
from typing import Annotated

import typer

from mosaic_core.cli.operator.account_options import Work, command
from mosaic_core.words.data_type import MosaicDataType
from mosaic_core.words.errors import ConnectionFailed, hint_at
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
            raise typer.BadParameter(f"{error.message} {error.cure}") from None
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
def robots(as_json: AsJson = False) -> Work:
    """List the robots of an account, with their state and connectors."""
    from mosaic_core.cli.operator.operator_session import list_robots

    return partial(list_robots, as_json=as_json)


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
