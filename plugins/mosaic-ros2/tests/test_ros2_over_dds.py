"""Connectors beside real nodes over DDS: topics, pictures, clouds, commands, services and actions."""

from __future__ import annotations

import asyncio
import json
import threading
from typing import Any

import numpy as np
import pytest
from mosaic_ros2.connectors.action import Ros2ActionConfigurer
from mosaic_ros2.connectors.publisher import Ros2PublisherConfigurer
from mosaic_ros2.connectors.service import Ros2ServiceConfigurer
from mosaic_ros2.connectors.topic import Ros2TopicConfigurer
from support.ros_side import RosNode, made, qos

from mosaic_core.testing import Joined, connector, joined, until

FIBONACCI = "example_interfaces/action/Fibonacci"


async def next_json(link: Joined, label: str) -> Any:
    message = await asyncio.wait_for(link.connection.receivable(label).next_message(), 10)
    return json.loads(message.data)


async def test_a_scan_of_a_node_becomes_a_standard_message(node: RosNode, here: dict[str, Any]) -> None:
    params = {**here, "topic": "/scan", "type": "sensor_msgs/msg/LaserScan"}
    scans = node.publisher("/scan", "sensor_msgs/msg/LaserScan", qos(reliable=False))
    async with joined(connector(Ros2TopicConfigurer, label="scan", params=params)) as link:
        link.connection.receivable("scan")
        await until(lambda: scans.readers)
        scans.write({"angle_min": -1, "angle_max": 1, "angle_increment": 1, "range_max": 8, "ranges": [1, 2, 9]})
        found = await next_json(link, "scan")
    assert found["ranges"] == [1.0, 2.0, None]


async def test_a_type_that_is_not_named_is_learnt_from_its_publisher(node: RosNode, here: dict[str, Any]) -> None:
    numbers = node.publisher("/numbers", "std_msgs/msg/Float32MultiArray", dds_name="acme::msg::dds_::Numbers_")
    async with joined(connector(Ros2TopicConfigurer, label="numbers", params={**here, "topic": "/numbers"})) as link:
        link.connection.receivable("numbers")
        await until(lambda: numbers.readers)
        numbers.write({"data": [1.5, float("nan")]})
        found = await next_json(link, "numbers")
    assert found["data"] == [1.5, None]


async def test_a_service_answers_the_operator_who_asked(node: RosNode, here: dict[str, Any]) -> None:
    node.server("/lamp", "std_srvs/srv/SetBool", lambda ask: {"success": ask.data, "message": f"lamp {ask.data}"})
    params = {**here, "service": "/lamp", "type": "std_srvs/srv/SetBool"}
    async with joined(connector(Ros2ServiceConfigurer, label="lamp", params=params)) as link:
        answers = await asyncio.gather(
            *(link.connection.request("lamp", {"data": value}, timeout_s=10) for value in (True, False, True))
        )
    assert [one["message"] for one in answers] == ["lamp True", "lamp False", "lamp True"]


async def test_a_service_that_nobody_serves_is_refused(node: RosNode, here: dict[str, Any]) -> None:
    params = {**here, "service": "/nobody", "type": "std_srvs/srv/SetBool"}
    async with joined(connector(Ros2ServiceConfigurer, label="lamp", params=params)) as link:
        with pytest.raises(Exception, match="no server of /nobody"):
            await link.connection.request("lamp", {"data": True}, timeout_s=10)


class FibonacciServer:
    """An action that counts until it is told to go on or to cancel."""

    def __init__(self, node: RosNode) -> None:
        self.feedback = node.publisher(
            "/count/_action/feedback",
            "example_interfaces/msg/Fibonacci_FeedbackMessage",
            dds_name="example_interfaces::action::dds_::Fibonacci_FeedbackMessage_",
        )
        self.goal: Any = None
        self.is_done = threading.Event()
        self.cancelled: Any = None
        node.server("/count/_action/send_goal", f"{FIBONACCI}_SendGoal", self._send)
        node.server("/count/_action/get_result", f"{FIBONACCI}_GetResult", self._result)
        node.server("/count/_action/cancel_goal", "action_msgs/srv/CancelGoal", self._cancel)

    def _send(self, ask: Any) -> dict[str, Any]:
        self.goal = ask
        return {"accepted": ask.goal.order > 0}

    def _result(self, ask: Any) -> dict[str, Any]:
        self.feedback.write({"goal_id": {"uuid": self.goal.goal_id.uuid}, "feedback": {"sequence": [0, 1]}})
        self.is_done.wait(20)
        return {"status": 4 if self.cancelled is None else 5, "result": {"sequence": [0, 1, 1, 2]}}

    def _cancel(self, ask: Any) -> dict[str, Any]:
        self.cancelled = ask.goal_info.goal_id.uuid
        self.is_done.set()
        return {"return_code": 0}


async def test_an_action_tells_its_feedback_and_its_result(node: RosNode, here: dict[str, Any]) -> None:
    server = FibonacciServer(node)
    told: list[Any] = []
    params = {**here, "action": "/count", "type": FIBONACCI, "requires_lease": False}
    async with joined(connector(Ros2ActionConfigurer, label="count", params=params)) as link:

        def progress(value: Any) -> None:
            told.append(value)
            server.is_done.set()

        answer = await link.connection.request("count", {"order": 4}, timeout_s=20, on_progress=progress)
        with pytest.raises(Exception, match="rejects"):
            await link.connection.request("count", {"order": 0}, timeout_s=10)
    assert told[0] == {"sequence": [0, 1]}
    assert answer == {"outcome": "succeeded", "result": {"sequence": [0, 1, 1, 2]}}


async def test_a_velocity_reaches_the_node_within_its_limits(node: RosNode, here: dict[str, Any]) -> None:
    heard = node.subscription("/cmd_vel", "geometry_msgs/msg/Twist")
    params = {**here, "topic": "/cmd_vel", "type": "geometry_msgs/msg/Twist"}
    safety = {"max_linear_mps": 0.5, "max_angular_radps": 1.0, "requires_lease": False}
    one = connector(Ros2PublisherConfigurer, label="drive", params=params, safety=safety)
    async with joined(one) as link:
        await until(lambda: heard.writers)
        store = link.connection.sendable("drive")
        await store.wait_open()
        store.send_json({"linear": {"x": 2.0}, "angular": {"z": 0.2}})
        first = (await asyncio.to_thread(heard.take))[0]
        standstill = (await asyncio.to_thread(heard.take))[0]
    assert (first.linear.x, first.angular.z) == pytest.approx((0.5, 0.2))
    assert standstill == made("geometry_msgs/msg/Twist")
    assert np.isclose(standstill.linear.x, 0.0)
