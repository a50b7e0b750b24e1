"""A leader arm moves a follower through a whole robot in memory."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections.abc import AsyncIterator
from typing import Any

import pytest
from typer.testing import CliRunner

from mosaic_arm.commands import calibrate_session
from mosaic_arm.commands.arm_commands import app, joint_params
from mosaic_arm.commands.follow_session import FollowSession
from mosaic_arm.joints import ArmJointsConfigurer
from mosaic_arm.params import ArmParams
from mosaic_arm.state import ArmStateConfigurer
from mosaic_core.messages import JointState
from mosaic_core.testing import Joined, connector, joined
from mosaic_core.words.errors import DeviceGone, MosaicError

ARM = {"bus": "fake", "port": "follower"}


@contextlib.asynccontextmanager
async def robot_with_an_arm() -> AsyncIterator[Joined]:
    joints = connector(ArmJointsConfigurer, label="joints", params={"arm": ARM})
    state = connector(ArmStateConfigurer, label="state", params={"arm": ARM, "rate_hz": 50})
    async with joined(joints, state) as link:
        yield link


def session(link: Joined, leader: ArmParams, **words: Any) -> FollowSession:
    words = {"state": "", "rate_hz": 100.0, "approach_radps": 2.0, **words}
    return FollowSession(robot=link.connection.robot_id, label="joints", leader=leader, as_json=True, **words)


async def test_the_follower_comes_and_follows_a_leader_that_a_hand_lets_down(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    async with robot_with_an_arm() as link:

        async def connected(*_: Any) -> Any:
            return link.connection

        monkeypatch.setattr("mosaic_arm.commands.follow_session.connected", connected)
        following = asyncio.create_task(
            session(link, ArmParams(bus="fake", port="leader", starts_free=True))(link.operator)
        )
        async with asyncio.timeout(20):
            async for received in link.connection.receivable("state").messages():
                state = JointState.model_validate_json(received.data)
                if state.positions[1] < -0.25:  # the leader's shoulder sinks 0.23 rad a second
                    break
        following.cancel()
        await asyncio.wait([following])
        await link.connection.control.wait_for(lambda: link.connection.control.leases["arm"].holder is None)
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert lines[-1]["phase"] == "following"
    assert lines[-1]["sent"] > 10
    assert lines[-1]["refusals"] == 0


@pytest.mark.parametrize(
    ("sent", "code", "says"),
    [
        ('{"names": ["elbow_flex"], "positions": [NaN]}', "safety.not_finite", "NaN"),
        ('{"names": ["elbow_flexx"], "positions": [0.1]}', "safety.out_of_range", "elbow_flexx"),
        ('{"names": ["elbow_flex"], "positions": []}', "safety.out_of_range", "positions"),
    ],
)
async def test_whoever_sends_what_can_not_be_is_told_why(sent: str, code: str, says: str) -> None:
    async with robot_with_an_arm() as link, await link.connection.control.take("arm"):
        refusals: asyncio.Queue[Any] = asyncio.Queue()
        link.connection.on_refusal(refusals.put_nowait)
        store = link.connection.sendable("joints")
        await store.wait_open()
        store.send_data(sent)
        async with asyncio.timeout(20):
            refusal = await refusals.get()
    assert (refusal.label, refusal.code) == ("joints", code)
    assert says in refusal.message


async def test_a_leader_that_is_not_there_takes_no_lease(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mosaic_arm.commands.follow_session.LEADER_OPENS_S", 0.2)
    async with robot_with_an_arm() as link:
        with pytest.raises(DeviceGone, match="can't be opened"):
            await session(link, ArmParams(port="/dev/mosaic-no-such-leader"))(link.operator)
        assert all(view.holder is None for view in link.connection.control.leases.values())


async def test_a_state_that_is_not_clear_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    from mosaic_arm.commands.follow_session import state_label

    async with robot_with_an_arm() as link:
        assert state_label(link.connection.catalogue, "") == "state"
        assert state_label(link.connection.catalogue, "mine") == "mine"
    async with joined(connector(ArmJointsConfigurer, label="joints", params={"arm": ARM})) as link:
        with pytest.raises(MosaicError, match="there are: none"):
            state_label(link.connection.catalogue, "")


def test_joints_of_the_command_line_are_those_of_the_params() -> None:
    assert joint_params([]) == {}
    assert ArmParams.model_validate(joint_params(["elbow=3"])).joints["elbow"].id == 3
    assert CliRunner().invoke(app, ["calibrate", "arm.json", "--joint", "elbow"]).exit_code == 2


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--joint", "elbow=999"], "joints.elbow.id"),
        (["--joint", "elbow=1", "--joint", "wrist=1"], "two joints have the motor 1"),
        (["--baud", "3"], "baud"),
        (["--full-turn", "wrst_roll"], "no joint 'wrst_roll'"),
    ],
)
def test_an_arm_that_there_can_not_be_is_a_wrong_word_of_the_command_line(words: list[str], said: str) -> None:
    ended = CliRunner().invoke(app, ["calibrate", "arm.json", *words])
    assert ended.exit_code == 2
    assert said in ended.output


def test_the_command_line_says_how_fast_a_bus_speaks(monkeypatch: pytest.MonkeyPatch) -> None:
    guided: list[ArmParams] = []
    monkeypatch.setattr(calibrate_session, "calibrate", lambda params, *_: guided.append(params))
    words = ["calibrate", "arm.json", "--bus", "dynamixel"]
    assert CliRunner().invoke(app, words).exit_code == 0
    assert CliRunner().invoke(app, [*words, "--baud", "57600"]).exit_code == 0
    assert [one.baud for one in guided] == [1_000_000, 57_600]
