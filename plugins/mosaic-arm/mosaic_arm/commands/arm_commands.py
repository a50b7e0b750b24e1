"""``mosaic arm``: calibrate an arm by hand, and have one arm follow another one."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from mosaic_core.cli.operator.account_options import Work, command
from mosaic_core.words.errors import hint_at

if TYPE_CHECKING:
    from mosaic_arm.params import ArmParams

app = typer.Typer(
    add_completion=False, no_args_is_help=True, help="Calibrate an arm of servos, and have one follow another."
)

BusName = Literal["feetech", "dynamixel", "fake"]
Port = Annotated[str, typer.Option(help="The serial port of its bus.")]
Bus = Annotated[BusName, typer.Option(help="The series of its servos.")]
Joints = Annotated[
    list[str], typer.Option("--joint", metavar="NAME=ID", help="A joint and its motor; none: the six of an SO-101.")
]
MEGABIT = 1_000_000
NO_JOINTS: list[str] = []
FULL_TURN = ["wrist_roll"]


def joint_params(pairs: list[str]) -> dict[str, Any]:
    """The ``joints`` of the params, or nothing where the default is meant."""
    joints: dict[str, Any] = {}
    for pair in pairs:
        name, equals, number = pair.partition("=")
        if not (name and equals and number.isdigit()):
            raise typer.BadParameter(f"--joint {pair}: write NAME=ID, such as --joint elbow=3")
        joints[name] = {"id": int(number)}
    if not joints:
        return {}
    return {"joints": joints, **({} if "gripper" in joints else {"gripper": None})}


def arm_of(**fields: Any) -> ArmParams:
    """The arm that the command line describes. Raises :class:`typer.BadParameter`."""
    from pydantic import ValidationError

    from mosaic_arm.params import ArmParams

    try:
        return ArmParams.model_validate(fields)
    except ValidationError as error:
        wrong = error.errors()[0]
        place, said = ".".join(str(part) for part in wrong["loc"]), wrong["msg"].removeprefix("Value error, ")
        raise typer.BadParameter(f"{place}: {said}" if place else said) from None


def known_joints(full_turn: list[str], joints: Collection[str]) -> list[str]:
    """The joints without an end that this arm has. Raises :class:`typer.BadParameter` for another that is named."""
    unknown = [one for one in full_turn if one not in joints]
    if unknown and full_turn != FULL_TURN:
        raise typer.BadParameter(f"--full-turn: this arm has no joint {unknown[0]!r}{hint_at(unknown[0], joints)}")
    return [one for one in full_turn if one in joints]


@app.command()
def calibrate(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The calibration file, as LeRobot writes it.")],
    port: Port = "/dev/ttyACM0",
    bus: Bus = "feetech",
    baud: Annotated[int, typer.Option(help="Bits per second of its bus.")] = MEGABIT,
    joint: Joints = NO_JOINTS,
    full_turn: Annotated[
        list[str], typer.Option(metavar="NAME", help="A joint without an end, which has its whole turn.")
    ] = FULL_TURN,
    write: Annotated[
        bool, typer.Option("--write", help="Only write a file that is there into the motors, which LETS THEM GO.")
    ] = False,
) -> None:
    """Find where the joints of an arm end, by moving it by hand; its motors are off meanwhile, so hold it."""
    from mosaic_arm.commands.calibrate_session import calibrate as guide
    from mosaic_arm.commands.calibrate_session import write_to_motors

    params = arm_of(port=port, bus=bus, baud=baud, **joint_params(joint))
    if write:
        write_to_motors(params, file)
    else:
        guide(params, file, known_joints(full_turn, params.joints))


@command(group=app, is_person=True, has_timeline=True)
def follow(
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="The robot's id or name.")],
    label: Annotated[str, typer.Argument(metavar="LABEL", help="The connector that takes JointTarget.")],
    leader_port: Annotated[str, typer.Option(help="The serial port of the leader's bus.")] = "/dev/ttyACM0",
    leader_bus: Annotated[BusName, typer.Option(help="The series of the leader's servos.")] = "feetech",
    leader_baud: Annotated[int, typer.Option(help="Bits per second of the leader's bus.")] = MEGABIT,
    leader_calibration: Annotated[str, typer.Option(help="The leader's calibration file.")] = "",
    joint: Joints = NO_JOINTS,
    state: Annotated[str, typer.Option(help="The connector that sends JointState; none: the only one.")] = "",
    rate_hz: Annotated[float, typer.Option(min=1, max=200, help="Commands per second.")] = 100.0,
    approach_radps: Annotated[float, typer.Option(min=0.01, max=2, help="How fast it comes at first.")] = 0.4,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object per line.")] = False,
) -> Work:
    """Have an arm of a robot follow the one beside this machine, which a hand leads. It comes slowly first."""
    from mosaic_arm.commands.follow_session import FollowSession

    bus = {"port": leader_port, "bus": leader_bus, "baud": leader_baud, "rate_hz": rate_hz}
    own = {"calibration": leader_calibration or None, "starts_free": True, "on_exit": "release"}
    leader = arm_of(**bus, **own, **joint_params(joint))
    return FollowSession(robot, label, state, leader, rate_hz, approach_radps, as_json)
