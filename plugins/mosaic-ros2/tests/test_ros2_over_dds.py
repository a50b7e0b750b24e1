"""Connectors beside real nodes over DDS: topics, pictures, clouds, commands, services and actions."""

from __future__ import annotations

import asyncio
import json
import threading
from typing import Any

import numpy as np
import pytest
from support.devices.ros_side import RosNode, made, qos

from mosaic_core.drill import findings as drill_findings
from mosaic_core.drill.drill import drill
from mosaic_core.laboratory.joining import configured_with
from mosaic_core.testing import Joined, build, collect, connector, joined, take_frames, until
from mosaic_ros2.bus.dds import dds_service
from mosaic_ros2.connectors.action import Ros2ActionConfigurer
from mosaic_ros2.connectors.image import Ros2ImageConfigurer
from mosaic_ros2.connectors.point_cloud import Ros2PointCloudConfigurer
from mosaic_ros2.connectors.publisher import Ros2PublisherConfigurer
from mosaic_ros2.connectors.service import Ros2ServiceConfigurer
from mosaic_ros2.connectors.topic import Ros2TopicConfigurer
from mosaic_sensors.point_cloud import decoded as decoded_cloud

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


async def test_a_service_that_nobody_serves_is_refused(
    node: RosNode, here: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    params = {**here, "service": "/nobody", "type": "std_srvs/srv/SetBool"}
    monkeypatch.setattr(dds_service, "MATCH_S", 0.5)
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


async def test_a_goal_is_cancelled_when_its_operator_gives_it_up(node: RosNode, here: dict[str, Any]) -> None:
    server = FibonacciServer(node)
    params = {**here, "action": "/count", "type": FIBONACCI, "requires_lease": False}
    async with joined(connector(Ros2ActionConfigurer, label="count", params=params)) as link:
        asked = asyncio.create_task(link.connection.request("count", {"order": 4}, timeout_s=20))
        await until(lambda: server.goal is not None)
        asked.cancel()
        await until(lambda: server.cancelled is not None)
    assert bytes(server.cancelled) == bytes(server.goal.goal_id.uuid)


async def test_a_service_of_another_type_is_told_with_what_to_write(
    node: RosNode, here: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dds_service, "MATCH_S", 0.5)
    node.server("/lamp", "std_srvs/srv/SetBool", lambda ask: {})
    params = {**here, "service": "/lamp", "type": "std_srvs/srv/Trigger"}
    async with joined(connector(Ros2ServiceConfigurer, label="lamp", params=params)) as link:
        with pytest.raises(Exception, match="write `type: std_srvs/srv/SetBool`"):
            await link.connection.request("lamp", {}, timeout_s=10)


async def test_a_node_that_vanishes_and_returns_is_heard_again(node: RosNode, domain: int) -> None:
    params = {"domain": domain, "topic": "/heat", "type": "sensor_msgs/msg/Temperature", "silence_s": 0.3}
    async with joined(connector(Ros2TopicConfigurer, label="heat", params=params)) as link:
        link.connection.receivable("heat")
        for celsius in (1.0, 2.0):
            heat = node.publisher("/heat", "sensor_msgs/msg/Temperature")
            await until(lambda heat=heat: heat.readers)  # type: ignore[misc]
            heat.write({"temperature": celsius})
            assert (await next_json(link, "heat"))["temperature_c"] == celsius
            heat.close()


def test_a_latched_map_comes_to_whoever_listens_later(node: RosNode, here: dict[str, Any]) -> None:
    maps = node.publisher("/map", "nav_msgs/msg/OccupancyGrid", qos(latched=True, depth=1))
    maps.write({"info": {"resolution": 0.1, "width": 2, "height": 1}, "data": [0, 100]})
    params = {**here, "topic": "/map", "type": "nav_msgs/msg/OccupancyGrid"}
    for _ in range(2):
        (grid,) = collect(build(Ros2TopicConfigurer, params=params), 1)
        assert grid.data == [0, 100]


class Repeated:
    """Publishes one message ten times a second until the block ends."""

    def __init__(self, write: Any) -> None:
        self._write = write
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def _run(self) -> None:
        while not self._is_over.wait(0.1):
            self._write()

    def __enter__(self) -> None:
        self._thread.start()

    def __exit__(self, *_: object) -> None:
        self._is_over.set()
        self._thread.join()


def test_pictures_and_clouds_of_a_node_arrive(node: RosNode, here: dict[str, Any]) -> None:
    pixels = np.full((48, 64, 3), (10, 20, 30), np.uint8)
    images = node.publisher("/image", "sensor_msgs/msg/Image", qos(reliable=False))
    clouds = node.publisher("/points", "sensor_msgs/msg/PointCloud2")
    points = np.arange(300, dtype=np.float32).reshape(100, 3)
    fields = [{"name": name, "offset": 4 * at, "datatype": 7, "count": 1} for at, name in enumerate("xyz")]

    def write() -> None:
        image = {"height": 48, "width": 64, "step": 192, "encoding": "rgb8", "data": pixels.reshape(-1)}
        images.write(image)
        size = {"height": 1, "width": 100, "point_step": 12, "row_step": 1200}
        clouds.write({**size, "fields": fields, "data": points.reshape(-1).view(np.uint8)})

    with Repeated(write):
        (picture,) = take_frames(build(Ros2ImageConfigurer, params={**here, "topic": "/image"}), 1)
        handler = build(Ros2PointCloudConfigurer, params={**here, "topic": "/points"})[0]
        (cloud,) = collect(handler, 1)  # type: ignore[arg-type]
    assert picture.image[0, 0].tolist() == [30, 20, 10]  # type: ignore[union-attr]
    np.testing.assert_allclose(decoded_cloud(cloud).xyz, points, atol=0.006)


async def test_the_drill_passes_on_a_base_and_on_an_arm_of_a_node(
    node: RosNode, here: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(drill_findings, "TOLERANCE_S", 10.0)  # how late a busy machine is must not decide here
    heard = node.subscription("/cmd_vel", "geometry_msgs/msg/Twist")
    params = {**here, "topic": "/cmd_vel", "type": "geometry_msgs/msg/Twist"}
    safety = {"max_linear_mps": 0.5, "max_angular_radps": 1.0, "timeout_s": 1.0, "max_rate_hz": 40}
    entry = connector(Ros2PublisherConfigurer, label="drive", params=params, safety=safety)
    configured = configured_with([entry])
    found = {
        one.exercise: one.verdict
        async for one in drill(configured, live=False, only=("silence", "stop", "out-of-range"))
    }
    assert "failed" not in found.values(), found
    assert found["silence"] == found["stop"] == "passed"
    assert heard.writers == 0
