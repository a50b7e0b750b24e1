"""`mosaic operator stop`, `clear`, `lease`, `journal`, `send` and `drive`, against a robot in memory."""

from __future__ import annotations

import asyncio
import json
import os
import pty
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any

import pytest

from mosaic_core.cli.operator import terminal_keys
from mosaic_core.cli.operator.control_actions import clear_stop, show_journal, show_leases, stop_robot, take_lease
from mosaic_core.cli.operator.drive_session import DriveSession, status_text
from mosaic_core.cli.operator.operator_send import SendAction
from mosaic_core.operator import LeaseDenied, LeaseLost
from mosaic_core.words import control
from mosaic_core.words.errors import ConnectionFailed

ROBOT = "r0"
VELOCITY = {"type": "object", "properties": {"linear": {"type": "object"}, "angular": {"type": "object"}}}
Words = Sequence[control.ControlMessage]


def stopped(by: str = "") -> control.StopState:
    return control.StopState(is_stopped=bool(by), by=by)


def lease(holder: control.PeerInfo | None = None, epoch: int = 0, *queue: control.LeaseWaiting) -> control.LeaseState:
    return control.LeaseState(resource="motion", holder=holder, epoch=epoch, queue=queue, expiry_s=2)


@pytest.fixture
def robot(world: Any) -> Any:
    """A robot that tells where things stand after its hello, and grants what is asked."""
    world.first_words = [control.Peers(you=world.peer_id), lease(), stopped()]
    for known in ("stop_answer", "clear_answer"):
        setattr(world, known, None)

    def answers(message: control.ControlMessage) -> Words:
        match message:
            case control.Hello():
                asyncio.get_running_loop().call_soon(lambda: [world.robot.say(one) for one in world.first_words])
                return []
            case control.Stop(id=id_):
                return [control.StopAck(id=id_, received_us=5_000_000, safe_us=world.stop_answer)]
            case control.StopClear():
                return [world.clear_answer or stopped()]
            case control.JournalRead():
                entry = control.JournalEntry(number=1, at="2026-01-01T00:00:00Z", what="stop", who="Bob", code="x")
                return [control.Journal(entries=(entry,))]
            case _:
                return world.robot.granted(message)  # type: ignore[no-any-return]

    world.robot.answer_to = answers
    return world.robot


def do(world: Any, work: Any) -> int:
    async def main() -> int:
        async with asyncio.timeout(30), world.operator(is_person=True) as operator:
            return await work(operator)  # type: ignore[no-any-return]

    return asyncio.run(main())


def test_stop_tells_how_long_it_took_and_that_it_is_no_emergency_stop(world: Any, robot: Any, capsys: Any) -> None:
    world.stop_answer = 5_001_000
    assert (
        do(world, partial(stop_robot, robot=ROBOT, reason="a dog", drive_label="", drive_type=None, as_json=False)) == 0
    )
    out = capsys.readouterr().out
    assert "stopped: answered after" in out
    assert "no certified emergency stop" in out
    assert robot.stops[0].reason == "a dog"
    assert do(world, lambda operator: stop_robot(operator, ROBOT, "", "", None, as_json=True)) == 0
    line = json.loads(capsys.readouterr().out)
    assert (line["stopped"], line["is_safe"]) == (True, True)


def test_clear_takes_the_lease_for_that_moment(world: Any, robot: Any, capsys: Any) -> None:
    world.first_words[-1] = stopped("Bob")
    assert do(world, partial(clear_stop, robot=ROBOT, as_json=False)) == 0
    assert "cleared" in capsys.readouterr().out
    assert len(robot.said(control.LeaseRequest)) == len(robot.said(control.LeaseRelease)) == 1


def test_a_supervisor_clears_without_the_lease(world: Any, robot: Any, capsys: Any) -> None:
    me = control.PeerInfo(peer_id=world.peer_id, role="supervisor", is_person=True)
    world.first_words = [control.Peers(you=world.peer_id, peers=(me,)), lease(), stopped("Bob")]
    assert do(world, partial(clear_stop, robot=ROBOT, as_json=True)) == 0
    assert json.loads(capsys.readouterr().out) == {"stopped": False, "was_stopped": True}
    assert robot.said(control.LeaseRequest) == []


def test_a_program_asks_for_no_lease_before_it_is_told_that_a_person_clears(world: Any, robot: Any) -> None:
    me = control.PeerInfo(peer_id=world.peer_id, role="operator", is_person=False)
    world.first_words = [control.Peers(you=world.peer_id, peers=(me,)), lease(), stopped("Bob")]
    world.clear_answer = control.Refusal(label="_mosaic", code="safety.person_clears")
    with pytest.raises(LeaseDenied, match="Only a person") as denied:
        do(world, partial(clear_stop, robot=ROBOT, as_json=False))
    assert denied.value.code == "safety.person_clears"
    assert robot.said(control.LeaseRequest) == []


def test_clearing_what_is_not_stopped_is_said(world: Any, robot: Any, capsys: Any) -> None:
    assert do(world, partial(clear_stop, robot=ROBOT, as_json=False)) == 0
    assert "was not stopped" in capsys.readouterr().out
    assert robot.said(control.StopClear) == []


def test_a_refused_clear_is_an_error_with_its_code(world: Any, robot: Any) -> None:
    world.first_words[-1] = stopped("Bob")
    world.clear_answer = control.Refusal(label="_mosaic", code="lease.forbidden")
    with pytest.raises(LeaseDenied) as denied:
        do(world, partial(clear_stop, robot=ROBOT, as_json=False))
    assert denied.value.code == "lease.forbidden"


def test_a_resource_that_is_asked_for_is_shown_alone(world: Any, robot: Any, capsys: Any) -> None:
    arm = control.LeaseState(resource="arm", holder=None, epoch=0, queue=(), expiry_s=2)
    world.first_words[1:2] = [lease(), arm]
    assert do(world, partial(show_leases, robot=ROBOT, resource="arm", as_json=True)) == 0
    assert [json.loads(line)["resource"] for line in capsys.readouterr().out.splitlines()] == ["arm"]
    assert do(world, partial(show_leases, robot=ROBOT, as_json=True)) == 0
    assert len(capsys.readouterr().out.splitlines()) == 2


def test_a_resource_that_the_robot_lacks_is_an_error(world: Any, robot: Any) -> None:
    with pytest.raises(ConnectionFailed, match=r"'nix'.*'motion'") as unknown:
        do(world, partial(show_leases, robot=ROBOT, resource="nix", as_json=False))
    assert unknown.value.code == "lease.unknown_resource"


def test_leases_are_shown_with_their_holder_and_who_waits(world: Any, robot: Any, capsys: Any) -> None:
    alice = control.PeerInfo(peer_id="a", name="Alice", is_person=True)
    waiting = control.LeaseWaiting(peer_id="b", name="Bob")
    world.first_words = [control.Peers(you=world.peer_id), lease(alice, 4, waiting), stopped("Carol")]
    assert do(world, partial(show_leases, robot=ROBOT, as_json=False)) == 0
    out = capsys.readouterr().out
    assert "Alice" in out
    assert "Bob" in out
    assert "stopped by Carol" in out
    assert do(world, partial(show_leases, robot=ROBOT, as_json=True)) == 0
    line = json.loads(capsys.readouterr().out)
    assert (line["holder"]["name"], line["epoch"], line["waiting"][0]["name"]) == ("Alice", 4, "Bob")


def taking(force_reason: str, *, releases: bool = False, as_json: bool = False) -> Callable[[Any], Any]:
    return lambda operator: take_lease(operator, ROBOT, "motion", force_reason, 1.0, releases=releases, as_json=as_json)


def test_a_lease_is_forced_with_its_reason_and_freed(world: Any, robot: Any, capsys: Any) -> None:
    assert do(world, taking("he is asleep", releases=True, as_json=True)) == 0
    outcomes = [json.loads(line)["outcome"] for line in capsys.readouterr().out.splitlines()]
    assert outcomes == ["granted", "released"]
    request = robot.said(control.LeaseRequest)[0]
    assert (request.force, request.reason) == (True, "he is asleep")


def test_a_held_lease_tells_who_asks_and_ends_when_it_is_lost(world: Any, robot: Any, capsys: Any) -> None:
    async def hold(operator: Any) -> int:
        holding = asyncio.create_task(taking("")(operator))
        async with asyncio.timeout(30):
            while not robot.said(control.LeaseRequest):  # noqa: ASYNC110
                await asyncio.sleep(0.01)
        me = control.PeerInfo(peer_id=world.peer_id)
        robot.say(lease(me, 7, control.LeaseWaiting(peer_id="b", name="Bob", reason="lunch")))
        await asyncio.sleep(0.05)
        robot.say(control.LeaseReply(resource="motion", outcome="ended", code="lease.taken_over"))
        return await holding

    with pytest.raises(LeaseLost) as lost:
        do(world, hold)
    assert lost.value.code == "lease.taken_over"
    assert "Bob asks for it: lunch" in capsys.readouterr().err


def test_the_journal_is_printed_oldest_first(world: Any, robot: Any, capsys: Any) -> None:
    assert do(world, partial(show_journal, robot=ROBOT, limit=5, as_json=False)) == 0
    assert "Bob" in capsys.readouterr().out
    assert do(world, partial(show_journal, robot=ROBOT, limit=5, as_json=True)) == 0
    assert json.loads(capsys.readouterr().out)["number"] == 1


def test_a_robot_without_leases_is_named(world: Any) -> None:
    world.robot.extensions = {}
    with pytest.raises(ConnectionFailed, match="neither leases nor the stop"):
        do(world, partial(show_leases, robot=ROBOT, as_json=False))


def test_send_takes_the_lease_only_where_one_is_wanted_and_says_so(world: Any, robot: Any, capsys: Any) -> None:
    assert do(world, SendAction(ROBOT, "lamp", "{}", 0.1, 0)) == 0
    assert robot.said(control.LeaseRequest) == []
    assert do(world, SendAction(ROBOT, "cmd_vel", "{}", 0.1, 0)) == 0
    assert "holding the lease of 'motion'" in capsys.readouterr().err
    assert robot.channels["cmd_vel"].frames()[0].epoch == 7
    assert len(robot.said(control.LeaseRelease)) == 1
    assert do(world, SendAction(ROBOT, "lamp", "{}", 0.1, 0, as_json=True)) == 0
    assert json.loads(capsys.readouterr().out.splitlines()[-1]) == {"sent": 1, "refused": 0, "codes": [], "gates": []}


@pytest.fixture
def keyboard(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[bytes], None]]:
    controller, terminal = pty.openpty()
    original = terminal_keys.terminal_keys
    monkeypatch.setattr(terminal_keys, "terminal_keys", lambda pressed: original(pressed, terminal))

    def type_in(data: bytes) -> None:
        os.write(controller, data)

    yield type_in
    os.close(controller)
    os.close(terminal)


def drivable(world: Any) -> None:
    catalogue = world.robot.catalogue
    entries = [
        entry.model_copy(update={"message_schema": VELOCITY}) if entry.label == "cmd_vel" else entry
        for entry in catalogue.entries
    ]
    world.robot.catalogue = type(catalogue).of(entries)


def velocities(robot: Any) -> list[Any]:
    """All that were sent."""
    channel = robot.channels.get("cmd_vel")
    return [json.loads(frame.payload) for frame in channel.frames()] if channel else []


def test_driving_sends_while_a_key_is_held_and_stops_the_robot_on_x(
    world: Any, robot: Any, keyboard: Callable[[bytes], None], capsys: Any
) -> None:
    drivable(world)
    world.stop_answer = 5_001_000

    async def drive(operator: Any) -> int:
        driving = asyncio.create_task(DriveSession(ROBOT, "cmd_vel", 0.3, 0.8, "", 1.0, True)(operator))
        async with asyncio.timeout(30):
            while not robot.said(control.LeaseRequest):  # noqa: ASYNC110
                await asyncio.sleep(0.01)
            keyboard(b"wa")
            while {"linear": {"x": 0.3}, "angular": {"z": 0.8}} not in velocities(robot):  # noqa: ASYNC110
                await asyncio.sleep(0.01)
            printed = ""
            while '"linear_mps": 0.3' not in printed:
                keyboard(b"w")
                await asyncio.sleep(0.05)
                printed += capsys.readouterr().out
            keyboard(b"x")
            while not robot.stops or velocities(robot)[-1]["linear"]["x"]:  # noqa: ASYNC110
                await asyncio.sleep(0.01)
            keyboard(b"q")
            return await driving

    assert do(world, drive) == 0
    assert {frame.epoch for frame in robot.channels["cmd_vel"].frames()} == {7}
    assert len(robot.said(control.LeaseRelease)) == 1


def test_a_driver_hands_over_to_who_asks_and_leaves(
    world: Any, robot: Any, keyboard: Callable[[bytes], None], capsys: Any
) -> None:
    drivable(world)

    async def drive(operator: Any) -> int:
        driving = asyncio.create_task(DriveSession(ROBOT, "cmd_vel", 0.3, 0.8, "", 1.0, True)(operator))
        async with asyncio.timeout(30):
            while not robot.said(control.LeaseRequest):  # noqa: ASYNC110
                await asyncio.sleep(0.01)
            me = control.PeerInfo(peer_id=world.peer_id)
            robot.say(lease(me, 7, control.LeaseWaiting(peer_id="b", name="Bob")))
            while not robot.said(control.LeaseAnswer):
                keyboard(b"G")
                await asyncio.sleep(0.05)
            robot.say(control.LeaseReply(resource="motion", outcome="ended", code="lease.handed_over"))
            return await driving

    assert do(world, drive) == 0
    assert (robot.said(control.LeaseAnswer)[0].peer_id, robot.said(control.LeaseAnswer)[0].grant) == ("b", True)
    assert "handed over" in capsys.readouterr().err


def test_a_driver_who_is_interrupted_with_a_key_held_leaves_the_robot_standing(
    world: Any, robot: Any, keyboard: Callable[[bytes], None]
) -> None:
    drivable(world)

    async def drive(operator: Any) -> None:
        driving = asyncio.create_task(DriveSession(ROBOT, "cmd_vel", 0.3, 0.8, "", 1.0, True)(operator))
        async with asyncio.timeout(30):
            while {"linear": {"x": 0.3}, "angular": {"z": 0.0}} not in velocities(robot):
                keyboard(b"w")
                await asyncio.sleep(0.05)
        driving.cancel()
        with pytest.raises(asyncio.CancelledError):
            await driving

    do(world, drive)
    assert velocities(robot)[-1] == {"linear": {"x": 0.0}, "angular": {"z": 0.0}}


def test_driving_what_takes_no_velocities_is_told(world: Any, robot: Any) -> None:
    with pytest.raises(ConnectionFailed, match="takes no velocities"):
        do(world, DriveSession(ROBOT, "lamp", 0.3, 0.8, "", 1.0, False))
    with pytest.raises(ConnectionFailed, match="did you mean 'cmd_vel'"):
        do(world, DriveSession(ROBOT, "cmdvel", 0.3, 0.8, "", 1.0, False))


def test_the_status_line_tells_everything_that_matters() -> None:
    status = {
        "linear_mps": 0.3, "angular_radps": -0.8, "holders": {"motion": "Alice"}, "asking": ["Bob"],
        "stopped_by": "Carol", "speed_factor": 0.25, "limited_by": ["rtt"], "round_trip_ms": 600.0,
        "refusals": 2, "last_refusal": "safety.stopped", "note": "cleared",
    }  # fmt: skip
    text = status_text(status).plain
    for part in (
        "+0.30 m/s",
        "-0.80 rad/s",
        "25%",
        "rtt",
        "600 ms",
        "Alice",
        "STOPPED by Carol",
        "Bob",
        "safety.stopped",
    ):
        assert part in text
