"""Nodes over DDS that vanish in the middle and return, that flood, and that say what can't be meant.

Bytes that are no messages of their type come over Zenoh alone: Cyclone DDS refuses them.
"""

from __future__ import annotations

import asyncio
import json
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from support.devices.ros_side import RosNode, encoded, qos

from mosaic_core.contract.devices.shared import Shared
from mosaic_core.contract.handler import Refused
from mosaic_core.machines.timing.backoff import BackoffPolicy
from mosaic_core.messages import Twist
from mosaic_core.testing import Joined, connector, joined, until
from mosaic_ros2.bus import kept_publication
from mosaic_ros2.bus.dds import dds_service
from mosaic_ros2.bus.dds.dds_service import MATCH_S
from mosaic_ros2.bus.kept_publication import KeptPublication
from mosaic_ros2.bus.qos import RELIABLE
from mosaic_ros2.cdr.encoding import CdrEncoder
from mosaic_ros2.connectors.action import Ros2ActionConfigurer
from mosaic_ros2.connectors.joint_watch import JointWatch
from mosaic_ros2.connectors.params import Ros2Params
from mosaic_ros2.connectors.publisher import Ros2PublisherConfigurer
from mosaic_ros2.connectors.publishing import TwistPublisher
from mosaic_ros2.connectors.service import Ros2ServiceConfigurer
from mosaic_ros2.connectors.topic import Ros2TopicConfigurer

TWIST = "geometry_msgs/msg/Twist"
TEMPERATURE = "sensor_msgs/msg/Temperature"
SET_BOOL = "std_srvs/srv/SetBool"
FIBONACCI = "example_interfaces/action/Fibonacci"
FEEDBACK = "example_interfaces/msg/Fibonacci_FeedbackMessage"
FLOOD = 3000
ASKED_WHILE_AWAY = round(30.0 / MATCH_S)
"""So often a question can be asked, and be given up, while its server is away for thirty seconds."""


@contextmanager
def another_node(domain: int) -> Iterator[RosNode]:
    """A node that is gone after the block, as one that crashed and was missed."""
    node = RosNode(domain)
    try:
        yield node
    finally:
        node.close()


@pytest.fixture(autouse=True)
def short_patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """A node that is away for a tenth of a second is away for three."""
    monkeypatch.setattr(dds_service, "MATCH_S", MATCH_S / 30)


async def lamp(link: Joined, is_on: bool = True) -> Any:
    return await link.connection.request("lamp", {"data": is_on}, timeout_s=60)


def answering(ask: Any) -> dict[str, Any]:
    return {"success": True, "message": f"lamp {ask.data}"}


async def refused(asking: Callable[[], Any], words: str) -> None:
    with pytest.raises(Exception, match=words):
        await asking()


async def test_a_service_is_refused_while_its_server_is_away_for_thirty_seconds_and_answers_when_it_is_back(
    domain: int,
) -> None:
    params = {"domain": domain, "service": "/lamp", "type": SET_BOOL}
    async with joined(connector(Ros2ServiceConfigurer, label="lamp", params=params)) as link:
        for _ in range(2):
            with another_node(domain) as node:
                node.server("/lamp", SET_BOOL, answering)
                assert (await lamp(link))["message"] == "lamp True"
            for _ in range(ASKED_WHILE_AWAY):
                await refused(lambda: lamp(link), "no server of /lamp is heard")


async def test_a_server_that_vanishes_in_the_middle_of_a_request_is_told(domain: int) -> None:
    asked, goes_on = threading.Event(), threading.Event()

    def never(ask: Any) -> dict[str, Any]:
        asked.set()
        goes_on.wait(60)
        return {}

    params = {"domain": domain, "service": "/lamp", "type": SET_BOOL, "timeout_s": 600}
    async with joined(connector(Ros2ServiceConfigurer, label="lamp", params=params)) as link:
        with another_node(domain) as node:
            server = node.server("/lamp", SET_BOOL, never)
            waiting = asyncio.create_task(lamp(link))
            await until(asked.is_set)
            server.close()
            await refused(lambda: waiting, "the server of /lamp is gone")
            goes_on.set()
        with another_node(domain) as node:
            node.server("/lamp", SET_BOOL, answering)
            assert (await lamp(link))["success"]


async def test_of_a_flood_on_a_topic_the_last_comes_and_what_can_not_be_is_left_out(
    node: RosNode, here: dict[str, Any]
) -> None:
    heat = node.publisher("/heat", TEMPERATURE, qos(reliable=True, depth=5))
    params = {**here, "topic": "/heat", "type": TEMPERATURE, "max_rate_hz": 1000}
    async with joined(connector(Ros2TopicConfigurer, label="heat", params=params)) as link:
        store = link.connection.receivable("heat")
        await until(lambda: heat.readers)

        def flood() -> None:
            for number in range(FLOOD):
                heat.write({"temperature": float("nan") if number % 2 else -300.0})
                heat.write({"temperature": float(number)})
            heat.write({"temperature": 9999.0})

        flooding = asyncio.create_task(asyncio.to_thread(flood))
        while json.loads((await asyncio.wait_for(store.next_message(), 60)).data)["temperature_c"] != 9999.0:
            pass
        await flooding


async def test_commands_go_on_once_somebody_subscribes_again(domain: int) -> None:
    params = {"domain": domain, "topic": "/lamp", "type": "std_msgs/msg/Bool"}
    async with joined(connector(Ros2PublisherConfigurer, label="lamp", params=params)) as link:
        told: list[Any] = []
        link.connection.on_refusal(told.append)
        store = link.connection.sendable("lamp")
        await store.wait_open()
        for _ in range(2):
            with another_node(domain) as node:
                heard = node.subscription("/lamp", "std_msgs/msg/Bool")
                await until(lambda heard=heard: heard.writers)  # type: ignore[misc]
                taken: list[Any] = []
                while not taken:
                    store.send_json({"data": True})
                    taken = await asyncio.to_thread(heard.take, 0.1)
                assert taken[0].data
                del heard
            told.clear()
            while not told:  # the operator is, and nothing is kept for later
                store.send_json({"data": True})
                await asyncio.sleep(0.02)
            assert "nobody subscribes" in told[0].message


async def test_a_writer_that_is_lost_is_opened_again_and_a_node_hears_a_standstill_before_the_next_command(
    node: RosNode, here: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kept_publication, "RETRY", BackoffPolicy(0.01, max_s=0.01))
    heard = node.subscription("/cmd_vel", TWIST, qos(depth=100))
    bus = Ros2Params(**here).bus(Shared())
    with bus, KeptPublication(bus, "/cmd_vel", TWIST, RELIABLE) as publication:
        drive = TwistPublisher("drive", publication, CdrEncoder(bus.book, TWIST))
        assert await asyncio.to_thread(publication.wait_until_heard, 60)
        drive.handle_data(Twist.planar(0.3))
        writer: Any = publication._publication
        writer._writer._delete(writer._writer._ref)
        with pytest.raises(Refused, match="can't be used any more"):
            drive.handle_data(Twist.planar(0.4))
        found: list[float] = []

        def standstill() -> bool:
            found.extend(one.linear.x for one in heard.take(0.05))
            return 0.0 in found

        while not await asyncio.to_thread(standstill):
            pass
        drive.handle_data(Twist.planar(0.5))
        while found[-1] != 0.5:
            await asyncio.to_thread(standstill)
    assert found == [0.3, 0.0, 0.5]


async def test_of_a_flood_of_commands_the_last_reaches_a_node_that_reads_slowly(
    node: RosNode, here: dict[str, Any]
) -> None:
    heard = node.subscription("/speed", "std_msgs/msg/Float64", qos(depth=1))
    params = {**here, "topic": "/speed", "type": "std_msgs/msg/Float64", "motion_fields": ["data"]}
    safety = {"timeout_s": 5.0, "requires_lease": False, "slow_down": "off"}
    async with joined(connector(Ros2PublisherConfigurer, label="speed", params=params, safety=safety)) as link:
        store = link.connection.sendable("speed")
        await store.wait_open()
        await until(lambda: heard.writers)
        for number in range(FLOOD):
            store.send_json({"data": float(number)})
        last = 0.0
        while last != FLOOD - 1:
            last = max([last, *(one.data for one in await asyncio.to_thread(heard.take))])


class Counting:
    """An action whose server says what a test wants, when it wants."""

    def __init__(self, node: RosNode) -> None:
        self.feedback = node.publisher(
            "/count/_action/feedback", FEEDBACK, dds_name="example_interfaces::action::dds_::Fibonacci_FeedbackMessage_"
        )
        self.goal: Any = None
        self.is_asked, self.is_done = threading.Event(), threading.Event()
        node.server("/count/_action/send_goal", f"{FIBONACCI}_SendGoal", self._send)
        self.results = node.server("/count/_action/get_result", f"{FIBONACCI}_GetResult", self._result)
        node.server("/count/_action/cancel_goal", "action_msgs/srv/CancelGoal", lambda ask: {"return_code": 0})

    def _send(self, ask: Any) -> dict[str, Any]:
        self.goal = ask
        return {"accepted": True}

    def _result(self, ask: Any) -> dict[str, Any]:
        self.is_asked.set()
        self.is_done.wait(60)
        return {"status": 4, "result": {"sequence": [1]}}


async def test_an_action_whose_server_vanishes_for_thirty_seconds_ends_and_the_next_goal_is_carried_out(
    domain: int,
) -> None:
    params = {"domain": domain, "action": "/count", "type": FIBONACCI, "requires_lease": False}
    async with joined(connector(Ros2ActionConfigurer, label="count", params=params)) as link:
        with another_node(domain) as node:
            server = Counting(node)
            waiting = asyncio.create_task(link.connection.request("count", {"order": 4}, timeout_s=60))
            await until(server.is_asked.is_set)
            server.results.close()
            await refused(lambda: waiting, "the server of /count/_action/get_result is gone")
            server.is_done.set()
            del server
        for _ in range(ASKED_WHILE_AWAY):
            again = link.connection.request("count", {"order": 4}, timeout_s=60)
            await refused(lambda again=again: again, "no server of /count/_action/send_goal is heard")  # type: ignore[misc]
        with another_node(domain) as node:
            server = Counting(node)
            server.is_done.set()
            answer = await link.connection.request("count", {"order": 4}, timeout_s=60)
            del server
    assert answer["outcome"] == "succeeded"


async def test_a_flood_of_feedback_also_of_others_goals_does_not_hold_up_a_goal(
    node: RosNode, here: dict[str, Any]
) -> None:
    server = Counting(node)
    told: list[Any] = []
    params = {**here, "action": "/count", "type": FIBONACCI, "requires_lease": False}
    async with joined(connector(Ros2ActionConfigurer, label="count", params=params)) as link:
        asked = link.connection.request("count", {"order": 4}, timeout_s=60, on_progress=told.append)
        waiting = asyncio.create_task(asked)
        await until(lambda: server.goal is not None)
        goal_id = server.goal.goal_id.uuid
        others = encoded(FEEDBACK, {"feedback": {"sequence": [9]}})
        mine = encoded(FEEDBACK, {"goal_id": {"uuid": goal_id}, "feedback": {"sequence": [0, 1]}})

        def flood() -> None:
            for _ in range(FLOOD):
                server.feedback.write_bytes(others)
                server.feedback.write_bytes(mine)

        await asyncio.to_thread(flood)
        await until(lambda: told)
        server.is_done.set()
        answer = await waiting
    assert answer["outcome"] == "succeeded"
    assert all(one == {"sequence": [0, 1]} for one in told)


def test_joint_states_that_make_no_sense_leave_an_arm_where_it_was_said_to_be(
    node: RosNode, here: dict[str, Any]
) -> None:
    states = node.publisher("/joint_states", "sensor_msgs/msg/JointState")
    watch = JointWatch(Ros2Params(**here).bus(Shared()), "/joint_states")
    good = {"name": ["a"], "position": [0.75]}
    with watch:
        waits = threading.Event()
        for _ in range(10_000):
            states.write({"name": ["a", "b"], "position": [float("nan")]})
            states.write(good)
            if watch.positions() or waits.wait(0.01):
                break
        assert watch.positions() == {"a": 0.75}
