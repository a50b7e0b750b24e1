"""`mosaic operator tail`, `send`, `drive`, `stop` and `robots` at an original robot in memory: no false word."""

from __future__ import annotations

import asyncio
import json
import os
import pty
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from typer.testing import CliRunner

from mosaic_core.cli.main import app
from mosaic_core.cli.operator import terminal_keys
from mosaic_core.cli.operator.control_actions import clear_stop, show_leases, stop_robot
from mosaic_core.cli.operator.drive_session import DriveSession
from mosaic_core.cli.operator.operator_send import SendAction
from mosaic_core.cli.operator.operator_session import list_robots
from mosaic_core.cli.operator.operator_tail import Tail
from mosaic_core.machines.peers import peer_of_operator as operator_peer
from mosaic_core.words.errors import ConnectionFailed

ROBOT = "r0"
ROWS = [
    {"connectorId": "odom", "connectorType": "JsonReceivableStore", "params": {}},
    {"connectorId": "front", "connectorType": "MediaStreamStore", "params": {}},
    {"connectorId": "cmd_vel", "connectorType": "Ros2WasdToTwistStore", "params": {}},
    {"connectorId": "h1", "connectorType": "h1-direction", "params": {}},
]


@pytest.fixture(autouse=True)
def quickly(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(operator_peer, "HELLO_TIMEOUT_S", 0.1)


@pytest.fixture
def untold(world: Any) -> Any:
    """An original robot of which nobody wrote anything down."""
    world.server.extensions = None
    world.robot.is_ours = False
    return world


@pytest.fixture
def original(untold: Any) -> Any:
    untold.server.connector_config = json.dumps({"connectors": ROWS})
    return untold


def do(world: Any, work: Any) -> int:
    async def main() -> int:
        async with asyncio.timeout(30), world.operator(is_person=True) as operator:
            return await work(operator)  # type: ignore[no-any-return]

    return asyncio.run(main())


def sent(world: Any, label: str) -> list[Any]:
    return [json.loads(text) for text in world.robot.channels[label].from_operator]


# -- tail and send -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("label", "data_type"), [("odom", None), ("anything", "json-r2u")])
def test_tail_prints_what_comes(original: Any, capsys: Any, label: str, data_type: str | None) -> None:
    async def look(operator: Any) -> int:
        tailing = asyncio.create_task(Tail(ROBOT, label, 1, False, data_type)(operator))
        while not tailing.done():
            channel = original.robot.channels.get(label)
            if channel is not None and channel.is_open:
                channel.on_message('{"x": 1}')
            await asyncio.sleep(0.01)
        return await tailing

    assert do(original, look) == 0
    assert capsys.readouterr().out == '{"x": 1}\n'
    assert list(original.robot.videos) == []  # nobody looks at the camera, so that it is not sent


def test_a_label_of_which_nothing_is_known_asks_for_its_data_type(untold: Any) -> None:
    with pytest.raises(ConnectionFailed, match="name its data type") as unknown:
        do(untold, Tail(ROBOT, "odom", 1, False))
    assert "--data-type" in unknown.value.cure


def test_silence_at_an_original_robot_is_explained(original: Any, capsys: Any, monkeypatch: Any) -> None:
    monkeypatch.setattr("mosaic_core.cli.operator.operator_tail.SILENCE_S", 0.05)

    async def look(operator: Any) -> int:
        tailing = asyncio.create_task(Tail(ROBOT, "odmo", 1, False, "json-r2u")(operator))
        said = ""
        while "leaves a label that it does not have unread" not in said:
            await asyncio.sleep(0.01)
            said += capsys.readouterr().err
        tailing.cancel()
        return 0

    assert do(original, look) == 0


def test_send_claims_no_refusals_that_an_original_robot_never_tells(original: Any, capsys: Any) -> None:
    assert do(original, SendAction(ROBOT, "cmd_vel", '{"linear":{"x":1}}', 0.1, 0.0)) == 0
    first, second = capsys.readouterr().out.splitlines()
    assert first == "1 sent, arrived; an original robot does not say what it refuses"
    assert "zero after them, arrived" in second


TWIST_ZERO = {"linear": {"x": 0, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": 0}}


@pytest.mark.parametrize(("label", "drive_type"), [("cmd_vel", None), ("base", "ros2-receiver-geometry-Twist")])
def test_send_leaves_a_drive_standing(original: Any, capsys: Any, label: str, drive_type: str | None) -> None:
    work = SendAction(ROBOT, label, '{"linear":{"x":1}}', 0.01, 0.02, True, None, drive_type)
    assert do(original, work) == 0
    assert sent(original, label) == [{"linear": {"x": 1}}] * 3 + [TWIST_ZERO]
    assert json.loads(capsys.readouterr().out) == {"sent": 3, "arrived": True, "zero_arrived": True}


def test_send_refuses_what_is_no_json(original: Any) -> None:
    with pytest.raises(ConnectionFailed, match="takes JSON, and this is none"):
        do(original, SendAction(ROBOT, "cmd_vel", "{bad", 0.01, 0.0))
    assert "cmd_vel" not in original.robot.channels or sent(original, "cmd_vel") == []


def test_send_sends_no_second_zero(original: Any, capsys: Any) -> None:
    assert do(original, SendAction(ROBOT, "cmd_vel", json.dumps(TWIST_ZERO), 0.01, 0.0)) == 0
    assert sent(original, "cmd_vel") == [TWIST_ZERO]
    assert "zero" not in capsys.readouterr().out


def test_send_says_when_its_last_zero_is_not_acknowledged(original: Any, capsys: Any, monkeypatch: Any) -> None:
    monkeypatch.setattr("mosaic_core.cli.operator.operator_send.ZERO_WAIT_S", 0.05)
    original.robot.acknowledges = False
    assert do(original, SendAction(ROBOT, "cmd_vel", '{"linear":{"x":1}}', 0.01, 0.0)) == 1
    assert "the robot may go on" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("work", "right", "wrong"),
    [
        (SendAction(ROBOT, "what", "{}", 0.1, 0.0), "json-u2r", "json-r2u"),
        (Tail(ROBOT, "what", 1, False), "json-r2u", "json-u2r"),
    ],
)
@pytest.mark.parametrize("is_described", [True, False])
def test_the_cure_of_an_unknown_label_names_the_right_direction_and_the_dashboard(
    original: Any, work: Any, right: str, wrong: str, is_described: bool
) -> None:
    if not is_described:
        original.server.connector_config = None
    with pytest.raises(ConnectionFailed) as unknown:
        do(original, work)
    assert f"--data-type {right}" in unknown.value.cure
    assert wrong not in unknown.value.cure
    assert "dashboard" in unknown.value.cure


def test_send_takes_a_data_type_where_nothing_is_described(untold: Any, capsys: Any) -> None:
    assert do(untold, SendAction(ROBOT, "gripper", "{}", 0.1, 0.0, True, "json-u2r")) == 0
    assert json.loads(capsys.readouterr().out) == {"sent": 1, "arrived": True}


@pytest.mark.parametrize("words", [["tail", "r0", "odom"], ["send", "r0", "odom", "{}"]])
def test_a_misspelt_data_type_is_told_the_nearest_before_anything_starts(words: list[str]) -> None:
    done = CliRunner().invoke(app, ["operator", *words, "--data-type", "jsonr2u"])
    assert done.exit_code == 2
    assert "json-r2u" in done.output


def test_robots_are_listed_with_the_labels_that_are_described(original: Any, capsys: Any) -> None:
    assert do(original, lambda operator: list_robots(operator, as_json=True)) == 0
    first = json.loads(capsys.readouterr().out.splitlines()[0])
    assert first["connectors"] == ["odom", "front", "cmd_vel", "h1"]


# -- stop ----------------------------------------------------------------------------------------------------------


def stopping(drive: str = "", drive_type: str | None = None, *, as_json: bool = False) -> Callable[[Any], Any]:
    return lambda operator: stop_robot(operator, ROBOT, "", drive, drive_type, as_json=as_json)


def test_stop_says_that_zeros_went_out_and_that_nothing_was_stopped(original: Any, capsys: Any) -> None:
    assert do(original, stopping()) == 1
    out = capsys.readouterr()
    assert "has no stop" in out.out
    assert "Zeros arrived at 'cmd_vel', 'h1' instead" in out.out
    assert "NOT STOPPED" not in out.err
    assert "stopped:" not in out.out
    assert sent(original, "h1") == [{"lin_vel_x": 0, "ang_vel_yaw": 0}]
    assert do(original, stopping(as_json=True)) == 1
    line = json.loads(capsys.readouterr().out)
    assert line == {"stopped": False, "arrived": ["cmd_vel", "h1"], "failed": []}


def test_stop_claims_nothing_where_no_drive_is_known(untold: Any, capsys: Any) -> None:
    assert do(untold, stopping()) == 1
    out = capsys.readouterr()
    assert "nothing was sent" in out.out
    assert "NOT STOPPED" in out.err


def test_stop_claims_nothing_where_the_channel_does_not_open(original: Any, capsys: Any, monkeypatch: Any) -> None:
    monkeypatch.setattr("mosaic_core.operator.control.original_drives.OPEN_S", 0.05)
    original.robot.opens_channels = False
    assert do(original, stopping()) == 1
    out = capsys.readouterr()
    assert "Zeros did NOT arrive at 'cmd_vel', 'h1'" in out.out
    assert "Zeros arrived" not in out.out
    assert "NOT STOPPED" in out.err


def test_stop_sends_zeros_to_a_drive_that_the_command_line_names(untold: Any, capsys: Any) -> None:
    assert do(untold, stopping("base", "turtlebot-receiver-teleop")) == 1
    assert "Zeros arrived at 'base'" in capsys.readouterr().out
    assert sent(untold, "base") == [{"linear_x": 0, "angular_z": 0}]


@pytest.mark.parametrize("work", [clear_stop, show_leases])
def test_what_an_original_robot_does_not_know_is_refused_in_words(original: Any, work: Any) -> None:
    with pytest.raises(ConnectionFailed, match="original MOSAIC"):
        do(original, lambda operator: work(operator, ROBOT, as_json=False))


# -- drive ---------------------------------------------------------------------------------------------------------


@pytest.fixture
def keyboard(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[bytes], None]]:
    controller, terminal = pty.openpty()
    real = terminal_keys.terminal_keys
    monkeypatch.setattr(terminal_keys, "terminal_keys", lambda pressed: real(pressed, terminal))

    def type_in(data: bytes) -> None:
        os.write(controller, data)

    yield type_in
    os.close(controller)
    os.close(terminal)


def driven(world: Any, keyboard: Callable[[bytes], None], session: DriveSession, moving: Any) -> int:
    async def drive(operator: Any) -> int:
        driving = asyncio.create_task(session(operator))
        async with asyncio.timeout(15):
            while session.label not in world.robot.channels or moving not in sent(world, session.label):
                assert not driving.done(), driving.result()
                keyboard(b"a")
                await asyncio.sleep(0.02)
            keyboard(b"q")
            return await driving

    return do(world, drive)


@pytest.mark.parametrize(
    ("label", "drive_type", "moving"),
    [
        ("cmd_vel", None, {"linear": {"x": 0.0, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": 0.5}}),
        ("h1", None, {"lin_vel_x": 0.0, "ang_vel_yaw": -0.5}),
        ("base", "turtlebot-receiver-teleop", {"linear_x": 0.0, "angular_z": 0.5}),
    ],
)
def test_driving_speaks_as_the_drive_wants_and_ends_with_a_zero(
    original: Any, keyboard: Callable[[bytes], None], capsys: Any, label: str, drive_type: str | None, moving: Any
) -> None:
    session = DriveSession(ROBOT, label, 0.3, 0.5, "", 1.0, True, drive_type)
    assert driven(original, keyboard, session, moving) == 0
    assert all(not value for value in numbers(sent(original, label)[-1]))
    err = capsys.readouterr().err
    assert "this robot has NO stop" in err
    assert "NOT acknowledged" not in err


def test_a_last_zero_that_is_not_acknowledged_is_said(
    original: Any, keyboard: Callable[[bytes], None], capsys: Any, monkeypatch: Any
) -> None:
    monkeypatch.setattr("mosaic_core.cli.operator.drive_session.ZERO_WAIT_S", 0.05)
    original.robot.acknowledges = False
    session = DriveSession(ROBOT, "h1", 0.3, 0.5, "", 1.0, True)
    assert driven(original, keyboard, session, {"lin_vel_x": 0.0, "ang_vel_yaw": -0.5}) == 0
    assert "the robot may go on" in capsys.readouterr().err


def numbers(message: dict[str, Any]) -> list[float]:
    return [one for value in message.values() for one in (numbers(value) if isinstance(value, dict) else [value])]


def test_what_does_not_drive_is_not_driven(original: Any) -> None:
    with pytest.raises(ConnectionFailed, match="odom"):
        do(original, DriveSession(ROBOT, "odom", 0.3, 0.5, "", 1.0, True))


def test_a_misspelt_drive_type_is_told_the_nearest() -> None:
    done = CliRunner().invoke(app, ["operator", "stop", "r0", "--drive", "x", "--type", "turtlebot-receiver-telop"])
    assert done.exit_code == 2
    assert "turtlebot-receiver-teleop" in done.output
