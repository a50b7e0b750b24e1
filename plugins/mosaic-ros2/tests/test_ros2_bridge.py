"""What connectors of a robot send, on topics of ROS: beside real nodes over DDS, and on a bus in memory."""

from __future__ import annotations

import asyncio
import json
import math
import socket
from collections.abc import Iterator
from contextlib import closing
from itertools import islice
from typing import Any

import numpy as np
import pytest
from support.devices.memory_bus import MemoryBus, MemoryPublication, SharedMemoryBus
from support.devices.ros_side import RosNode, decoded, qos

from mosaic_core import DataChannelConfigurer, DataChannelSendable, DeviceGone, NoParams
from mosaic_core.contract.data_tap import TappedChannel, TappedMessage
from mosaic_core.contract.sender import Sender
from mosaic_core.laboratory.joining import configured_with
from mosaic_core.machines.delivery.framing import PayloadKind
from mosaic_core.messages import (
    Diagnostic,
    OccupancyGrid,
    Pose,
    StandardMessage,
    Temperature,
    Transform,
)
from mosaic_core.testing import FakeClock, FakeHost, connector, fake_host, joined, until
from mosaic_core.words.data_type import MosaicDataType
from mosaic_core.words.errors import ConfigError, MosaicError
from mosaic_ros2.bus.bus import BusError
from mosaic_ros2.bus.qos import QosProfile
from mosaic_ros2.cdr.decoding import Decoder
from mosaic_ros2.cdr.encoding import CdrEncoder
from mosaic_ros2.connectors.bridge import Ros2BridgeConfigurer, Ros2BridgeParams, RosBridge
from mosaic_ros2.connectors.topic import Ros2TopicConfigurer
from mosaic_ros2.conversion.clouds import cloud_from
from mosaic_ros2.conversion.compact import cloud_fields
from mosaic_ros2.conversion.parts import Origin
from mosaic_ros2.definitions.type_book import TypeBook
from mosaic_sensors.laser_scan import encoded_scan, scan_of
from mosaic_sensors.laser_scan.udp import LaserScanConfigurer
from mosaic_sensors.point_cloud import cloud_of
from mosaic_sensors.point_cloud.compact_form import encoded as encoded_cloud

HEAT = TappedChannel("heat", "test", MosaicDataType.JSON_R2U, Temperature.schema_id)
LIDAR = TappedChannel("lidar", "laser-scan", MosaicDataType.BYTE_R2U)


class Heat(DataChannelSendable[Temperature]):
    """Sends a temperature ten times a second."""

    def messages(self) -> Iterator[Temperature]:
        for tick in self.every(0.1):
            yield Temperature(temperature_c=tick)


class HeatConfigurer(DataChannelConfigurer[NoParams]):
    """A thermometer."""

    connector_type = "test-heat"

    def configure(self) -> Heat:
        return Heat(self.label)


def told(label: str, payload: bytes | StandardMessage, **more: Any) -> TappedMessage:
    data = payload if isinstance(payload, bytes) else payload.model_dump_json().encode()
    return TappedMessage(label, PayloadKind.JSON, data, 1.0, 1.0, **more)


def bridge(bus: MemoryBus, channels: list[TappedChannel], *messages: TappedMessage, **topics: Any) -> RosBridge:
    handler = RosBridge("ros", Ros2BridgeParams(topics=topics), SharedMemoryBus(bus))
    host = FakeHost(bus.clock)
    host.tapped_channels, host.tapped_data = channels, list(messages)
    handler.bind(host)
    return handler


@pytest.fixture
def bus() -> MemoryBus:
    return MemoryBus(FakeClock())


def reports(handler: RosBridge, count: int) -> list[Diagnostic]:
    return list(islice(handler.messages(), count))


async def test_a_lidar_of_a_robot_is_heard_by_a_node_without_a_line_of_code(
    node: RosNode, here: dict[str, Any]
) -> None:
    scans = node.subscription("/scan", "sensor_msgs/msg/LaserScan", qos(reliable=False))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    lidar = connector(LaserScanConfigurer, label="lidar", params={"source": f"udp://127.0.0.1:{port}"})
    ros = connector(Ros2BridgeConfigurer, label="ros", params={**here, "topics": {"lidar": "/scan"}})
    scan = scan_of([1.0, math.nan, 2.5], -0.5, 0.5, intensities=[1, 2, 3], range_max_m=12.0)
    found: list[Any] = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        async with joined(lidar, ros):

            def heard() -> bool:
                """The first scan opens the topic, and the node finds it after that."""
                sender.sendto(encoded_scan(scan), ("127.0.0.1", port))
                found.extend(scans.take(0.05))
                return bool(found)

            while not await asyncio.to_thread(heard):
                pass
    assert found[0].header.frame_id == "lidar"
    assert found[0].header.stamp.sec > 1_600_000_000
    assert found[0].ranges.tolist() == [1.0, math.inf, 2.5]
    assert (found[0].angle_min, found[0].angle_max, found[0].range_max) == (-0.5, 0.5, 12.0)
    assert found[0].intensities.tolist() == pytest.approx([1, 2, 3], abs=0.01)


async def test_a_topic_that_is_bridged_and_read_by_the_same_robot_does_not_go_round(
    node: RosNode, here: dict[str, Any]
) -> None:
    """Also while another node publishes there."""
    other = node.publisher("/heat", "sensor_msgs/msg/Temperature")
    heard = node.subscription("/heat", "sensor_msgs/msg/Temperature")
    read = connector(
        Ros2TopicConfigurer, label="heat", params={**here, "topic": "/heat", "type": "sensor_msgs/Temperature"}
    )
    ros = connector(Ros2BridgeConfigurer, label="ros", params={**here, "topics": {"heat": "/heat"}})
    async with joined(read, ros) as link:
        link.connection.receivable("heat")
        await until(lambda: other.readers >= 2 and heard.writers >= 2)  # its own node's reader is one of them
        other.write({"temperature": 20.0})
        found: list[float] = []
        while len(found) < 2:
            found += [one.temperature for one in await asyncio.to_thread(heard.take)]
        assert await asyncio.to_thread(heard.take, 0.5) == []
    assert found == [20.0, 20.0]


async def test_operators_see_who_hears_what_a_robot_bridges(node: RosNode, here: dict[str, Any]) -> None:
    heat = connector(HeatConfigurer, label="heat")
    ros = connector(Ros2BridgeConfigurer, label="ros", params={**here, "topics": {"heat": "/heat"}})
    async with joined(heat, ros) as link:
        store = link.connection.receivable("ros")

        async def report() -> dict[str, Any]:
            return json.loads((await asyncio.wait_for(store.next_message(), 20)).data)  # type: ignore[no-any-return]

        while (await report())["level"] != "warn":
            pass
        heard = node.subscription("/heat", "sensor_msgs/msg/Temperature")
        while (found := await report())["level"] != "ok" or found["values"]["published"] == "0":
            pass
        assert heard.take()
    assert found["name"] == "heat → /heat"
    assert found["values"]["subscriptions"] == "1"


def test_what_is_no_message_is_counted_told_and_the_next_one_goes_on(bus: MemoryBus) -> None:
    good = told("heat", Temperature(temperature_c=20))
    handler = bridge(bus, [HEAT], told("heat", b"nonsense"), told("heat", b"{}"), good, heat="/heat")
    reports(handler, 2)
    assert [decoded("sensor_msgs/msg/Temperature", one).temperature for one in bus.published] == [20]
    assert fake_host(handler).losses["refused"] == 2


def test_a_bus_that_takes_nothing_is_told_to_operators(bus: MemoryBus) -> None:
    messages = [told("heat", Temperature(temperature_c=20))] * 3
    handler = bridge(bus, [HEAT], *messages, heat="/heat")
    running = handler.messages()
    next(running)
    bus.is_slow = True
    assert next(running).level == "error"
    assert fake_host(handler).losses["refused"] == 2


def test_a_bus_that_is_away_for_thirty_seconds_is_gone_and_published_to_when_it_is_back(bus: MemoryBus) -> None:
    handler = bridge(bus, [HEAT], *[told("heat", Temperature(temperature_c=20))] * 2, heat="/heat")
    with closing(handler.messages()) as running:
        next(running)
        bus.fails = True
        with pytest.raises(DeviceGone, match="the bus is away"):
            next(running)
    for _ in range(6):  # as the robot tries again
        bus.clock.advance(5.0)
        with pytest.raises(DeviceGone, match="the bus is away"):
            reports(handler, 1)
    bus.fails = False
    bus.published.clear()
    fake_host(handler).tapped_data = [told("heat", Temperature(temperature_c=21))]
    *_, last = reports(handler, 2)
    assert [decoded("sensor_msgs/msg/Temperature", one).temperature for one in bus.published] == [21]
    assert last.level == "ok"


def test_a_topic_that_the_bus_would_not_open_is_opened_with_the_next_scan(
    bus: MemoryBus, monkeypatch: pytest.MonkeyPatch
) -> None:
    scans = [told("lidar", encoded_scan(scan_of([1.0, 2.0], 0.0, 0.1)))] * 2
    publish, refusals = bus.publish, [BusError("the bus is busy", "wait")]

    def hesitant(topic: str, type_name: str, policies: QosProfile) -> MemoryPublication:
        if refusals:
            raise refusals.pop()
        return publish(topic, type_name, policies)

    monkeypatch.setattr(bus, "publish", hesitant)
    *_, last = reports(bridge(bus, [LIDAR], *scans, lidar="/scan"), 2)
    assert (last.level, last.values["refused"], len(bus.published)) == ("ok", "1", 1)


def test_commands_of_operators_are_not_published(bus: MemoryBus) -> None:
    command = told("heat", Temperature(temperature_c=99), sender=Sender("u", "p", "Alice"))
    reports(bridge(bus, [HEAT], command, told("heat", Temperature(temperature_c=20)), heat="/heat"), 2)
    assert [decoded("sensor_msgs/msg/Temperature", one).temperature for one in bus.published] == [20]


def test_where_nobody_subscribes_nothing_is_published_but_what_latecomers_need(bus: MemoryBus) -> None:
    bus.readers = 0
    grid = OccupancyGrid(resolution=1, width=1, height=1, origin=Pose(position={"x": 0, "y": 0}), data=[7])  # type: ignore[arg-type]
    channels = [HEAT, TappedChannel("map", "test", MosaicDataType.JSON_R2U, OccupancyGrid.schema_id)]
    messages = (told("heat", Temperature(temperature_c=20)), told("map", grid))
    reports(bridge(bus, channels, *messages, heat="/heat", map="/map"), 3)
    (only,) = bus.published
    found = decoded("nav_msgs/msg/OccupancyGrid", only)
    assert (found.data.tolist(), found.header.frame_id) == ([7], "map")


def test_frames_go_to_tf_where_the_file_says_so(bus: MemoryBus) -> None:
    moved = Transform(frame_id="odom", child_frame_id="base_link", translation={"x": 1, "y": 2})  # type: ignore[arg-type]
    channels = [TappedChannel("moved", "test", MosaicDataType.JSON_R2U, Transform.schema_id)]
    topic = {"topic": "/tf", "type": "tf2_msgs/msg/TFMessage"}
    reports(bridge(bus, channels, told("moved", moved), moved=topic), 2)
    (found,) = decoded("tf2_msgs/msg/TFMessage", bus.published[0]).transforms
    assert (found.header.frame_id, found.child_frame_id, found.transform.translation.y) == ("odom", "base_link", 2)


def test_scans_and_clouds_go_in_each_form_that_sensors_send(bus: MemoryBus) -> None:
    scan = scan_of([1.0, 2.0], 0.0, 0.1, frame_id="laser")
    as_json = {"angle_min": 0, "angle_max": 0.1, "angle_increment": 0.1, "range_max": 9, "ranges": [1, None]}
    cloud = cloud_of(np.array([[1.0, 2.0, 3.0, 0.5]], np.float32), captured_at_s=1.0)
    channels = [
        LIDAR,
        TappedChannel("text", "t", MosaicDataType.BYTE_R2U),
        TappedChannel("cloud", "t", MosaicDataType.BYTE_R2U),
    ]
    messages = (
        told("lidar", encoded_scan(scan)),
        told("text", json.dumps(as_json).encode()),
        told("cloud", encoded_cloud(cloud).plain()),
    )
    reports(bridge(bus, channels, *messages, lidar="/scan", text="/other", cloud="/points"), 5)
    first, second = (decoded("sensor_msgs/msg/LaserScan", one) for one in bus.published[:2])
    assert (first.header.frame_id, second.header.frame_id) == ("laser", "text")
    assert second.ranges.tolist() == [1.0, math.inf]
    points = decoded("sensor_msgs/msg/PointCloud2", bus.published[2])
    assert ([one.name for one in points.fields], points.width) == (["x", "y", "z", "intensity"], 1)
    np.testing.assert_allclose(points.data.view(np.float32), [1, 2, 3, 0.5], atol=0.01)


def test_a_cloud_with_all_that_it_may_have_comes_back_from_ros() -> None:
    name, book = "sensor_msgs/msg/PointCloud2", TypeBook(shares=())
    xyz = np.arange(30.0).reshape(10, 3)
    rgb = np.arange(30, dtype=np.uint8).reshape(10, 3)
    cloud = cloud_of(xyz, intensity=np.arange(10.0), rgb=rgb)
    data = CdrEncoder(book, name).encode(cloud_fields(cloud, Origin(1, "lidar")))
    assert decoded(name, data).header.frame_id == "lidar"
    back = cloud_from(Decoder(book, name).decode(data), 0.0)
    np.testing.assert_array_equal(back.xyz, xyz)
    np.testing.assert_array_equal(back.intensity, np.arange(10.0))  # type: ignore[arg-type]
    np.testing.assert_array_equal(back.rgb, rgb)  # type: ignore[arg-type]
    empty = CdrEncoder(book, name).encode(cloud_fields(cloud_of(np.empty((0, 3))), Origin()))
    assert decoded(name, empty).width == 0


def test_bytes_that_are_neither_scan_nor_cloud_are_told(bus: MemoryBus) -> None:
    handler = bridge(bus, [LIDAR], told("lidar", b"\1\2\3\4"), lidar="/scan")
    *_, last = reports(handler, 2)
    assert (last.level, last.values["refused"]) == ("error", "1")
    assert "neither a scan nor a cloud" in last.message


@pytest.mark.parametrize(
    ("channel", "topic", "match"),
    [
        (TappedChannel("heat", "acme", MosaicDataType.JSON_R2U), "/heat", r"'heat' \(acme\) sends no standard message"),
        (TappedChannel("heat", "a", MosaicDataType.JSON_U2R, "mosaic/Twist@1"), "/heat", "sends no standard message"),
        (HEAT, {"topic": "/h", "type": "sensor_msgs/Imu"}, "which is no .*Imu. Write `type:` sensor_msgs/msg/Temp"),
    ],
)
def test_what_can_not_be_bridged_is_told_with_the_cure(
    bus: MemoryBus, channel: TappedChannel, topic: Any, match: str
) -> None:
    with pytest.raises(MosaicError, match=match):
        reports(bridge(bus, [channel], heat=topic), 1)


def test_a_robot_that_loses_the_connector_says_so(bus: MemoryBus) -> None:
    handler = bridge(bus, [], heat="/heat")
    fake_host(handler).tapped_data = None
    with pytest.raises(DeviceGone, match=r"nothing comes of heat any more \(channel.unknown_label\)"):
        reports(handler, 2)


def test_mistakes_of_the_file_are_told_before_the_robot_starts() -> None:
    def configured(topics: Any) -> None:
        entries = [
            connector(HeatConfigurer, label="heat"),
            connector(Ros2BridgeConfigurer, label="ros", params={"topics": topics}),
        ]
        configured_with(entries)

    configured({"heat": "/heat"})
    for topics, words in (
        ({"haet": "/heat"}, "did you mean 'heat'"),
        ({"heat": "a b"}, "is no name of ROS"),
        (
            {"heat": {"topic": "/heat", "type": "sensor_msgs/msg/Temperatur"}},
            "did you mean 'sensor_msgs/msg/Temperature'",
        ),
        ({}, "at least 1"),
    ):
        with pytest.raises(ConfigError, match=words):
            configured(topics)
