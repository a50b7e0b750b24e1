"""The same connectors beside a node of rmw_zenoh and its router: keys, attachments, tokens and type hashes."""

from __future__ import annotations

import asyncio
import json
import random
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.devices.ros_side import STORE
from support.devices.zenoh_side import ZenohRos
from support.processes import free_port
from support.waiting import wait_for
from typer.testing import CliRunner

from mosaic_core import DeviceGone
from mosaic_core.cli.main import app
from mosaic_core.contract.devices.shared import Shared
from mosaic_core.testing import build, collect, connector, feed, joined, until
from mosaic_ros2.bus.bus import HeardEndpoint
from mosaic_ros2.bus.qos import LATCHED, SENSOR, QosProfile
from mosaic_ros2.bus.zenoh import zenoh_service
from mosaic_ros2.bus.zenoh.ros_keys import attachment, key_of, read_attachment, read_token, token_of
from mosaic_ros2.connectors.publisher import Ros2PublisherConfigurer
from mosaic_ros2.connectors.service import Ros2ServiceConfigurer
from mosaic_ros2.connectors.topic import Ros2TopicConfigurer
from mosaic_ros2.definitions.type_book import TypeBook
from mosaic_ros2.definitions.type_hash import service_hash, type_hash

DOMAIN = 3
BOOK = TypeBook(shares=())


@pytest.fixture
def ros() -> Iterator[ZenohRos]:
    running = ZenohRos(DOMAIN)
    yield running
    running.close()


@pytest.fixture
def here(ros: ZenohRos) -> dict[str, Any]:
    return {"transport": "zenoh", "domain": DOMAIN, "peers": [ros.router]}


def has_char(name: str) -> bool:
    """rosbags hashes ``char`` as a character; ROS makes ``uint8`` of it (rosidl_adapter), as its own hashes show."""
    return any(field.type.base == "char" for definition in BOOK.closure(name).values() for field in definition.fields)


@pytest.mark.parametrize("distribution", ["kilted", "humble"])
def test_hashes_of_types_are_those_of_rosbags(distribution: str) -> None:
    book = TypeBook(distribution=distribution, shares=())
    names = [one for one in STORE.fielddefs if book.knows(one) and "/msg/" in one and not has_char(one)]
    changed = {"rosbag2_interfaces", "example_interfaces", "std_srvs", "action_msgs"}
    if distribution == "humble":
        names = [one for one in names if "Range" not in one]
    for name in names:
        if name.split("/")[0] not in changed:
            assert type_hash(book, name) == STORE.hash_rihs01(name), name
    assert len(names) > 140


def test_the_hash_of_a_service_is_the_one_in_rmw_zenohs_documentation() -> None:
    assert service_hash(BOOK, "example_interfaces/srv/AddTwoInts") == (
        "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"
    )
    assert key_of(2, "/add_two_ints", "example_interfaces/srv/AddTwoInts", "H") == (
        "2/add_two_ints/example_interfaces::srv::dds_::AddTwoInts_/H"
    )


@given(st.booleans(), st.booleans(), st.integers(0, 1000), st.sampled_from(["publisher", "server"]))
def test_a_token_says_who_is_there(reliable: bool, latched: bool, depth: int, role: Any) -> None:
    endpoint = HeardEndpoint("/arm/state", "std_msgs/msg/Bool", role, QosProfile(reliable, latched, depth))
    found = read_token(token_of(3, "abc", 7, endpoint, "RIHS01_x"))
    assert found is not None
    assert (found.session, found.endpoint, found.hash) == ("abc", endpoint, "RIHS01_x")


@given(st.text(max_size=60))
def test_a_token_of_nobody_is_none(text: str) -> None:
    assert read_token(text) is None
    assert read_token(f"@ros2_lv/{text}") is None or text.count("/") == 11


@given(st.integers(-(2**63), 2**63 - 1), st.integers(0, 2**63 - 1), st.binary(min_size=16, max_size=16))
def test_an_attachment_is_read_back(number: int, at_ns: int, sender: bytes) -> None:
    assert read_attachment(attachment(number, at_ns, sender)) == (number, at_ns)
    assert len(attachment(number, at_ns, sender)) == 33
    assert read_attachment(sender) is None


async def test_a_scan_of_a_node_becomes_a_standard_message(ros: ZenohRos, here: dict[str, Any]) -> None:
    publish = ros.publisher("/scan", "sensor_msgs/msg/LaserScan")
    params = {**here, "topic": "/scan", "type": "sensor_msgs/msg/LaserScan"}
    scan = {"angle_min": -1, "angle_max": 1, "angle_increment": 1, "range_max": 8, "ranges": [1, 2, 9]}
    async with joined(connector(Ros2TopicConfigurer, label="scan", params=params)) as link:
        store = link.connection.receivable("scan")
        message = asyncio.create_task(store.next_message())
        while not message.done():
            publish(scan)
            await asyncio.wait([message], timeout=0.05)
    assert json.loads(message.result().data)["ranges"] == [1.0, 2.0, None]


async def test_bytes_that_are_no_message_cost_nothing_but_themselves(ros: ZenohRos, here: dict[str, Any]) -> None:
    """Zenoh carries whatever it is given; Cyclone DDS refuses what its type can't be on both ends."""
    publish, drawn = ros.publisher("/heat", "sensor_msgs/msg/Temperature"), random.Random(7)
    params = {**here, "topic": "/heat", "type": "sensor_msgs/msg/Temperature", "max_rate_hz": 1000}
    async with joined(connector(Ros2TopicConfigurer, label="heat", params=params)) as link:
        store = link.connection.receivable("heat")
        message = asyncio.create_task(store.next_message())
        while not message.done() or link.robot.snapshot().connectors[0].refused < 10:
            for _ in range(20):
                publish(b"\0\1\0\0"[: drawn.randrange(5)] + drawn.randbytes(drawn.randrange(40)))
            publish({"temperature": 21.5})
            await asyncio.sleep(0.05)
    assert json.loads(message.result().data)["temperature_c"] == 21.5


def first_told(params: dict[str, Any]) -> Any:
    """What a robot of its own hears first. The clock of the kit runs ahead of a busy router, so it tries again."""
    shared, told = Shared(), list[Any]()

    def is_told() -> bool:
        with suppress(DeviceGone):
            told.extend(collect(build(Ros2TopicConfigurer, params=params, shared=shared), 1))
        return bool(told)

    with shared.entered():
        wait_for(is_told, "the first message")
    return told


def test_a_latched_map_comes_to_whoever_listens_later(ros: ZenohRos, here: dict[str, Any]) -> None:
    info = {"resolution": 0.1, "width": 1, "height": 1}
    ros.latched("/map", "nav_msgs/msg/OccupancyGrid", {"info": info, "data": [7]})
    params = {**here, "topic": "/map", "type": "nav_msgs/msg/OccupancyGrid", "silence_s": 600}
    for _ in range(2):
        (grid,) = first_told(params)
        assert grid.data == [7]


async def test_a_velocity_reaches_the_node(ros: ZenohRos, here: dict[str, Any]) -> None:
    heard = ros.subscription("/cmd_vel", "geometry_msgs/msg/Twist")
    params = {**here, "topic": "/cmd_vel", "type": "geometry_msgs/msg/Twist"}
    safety = {"max_linear_mps": 0.5, "max_angular_radps": 1.0, "requires_lease": False}
    async with joined(connector(Ros2PublisherConfigurer, label="drive", params=params, safety=safety)) as link:
        store = link.connection.sendable("drive")
        await store.wait_open()

        def sent() -> bool:
            store.send_json({"linear": {"x": 2.0}})
            return any(one.linear.x == 0.5 for one in heard)

        await until(sent)
        await until(lambda: heard[-1].linear.x == 0.0)


async def test_a_service_answers_the_operator_who_asked(ros: ZenohRos, here: dict[str, Any]) -> None:
    ros.server("/lamp", "std_srvs/srv/SetBool", lambda ask: {"success": ask.data, "message": f"lamp {ask.data}"})
    params = {**here, "service": "/lamp", "type": "std_srvs/srv/SetBool"}
    async with joined(connector(Ros2ServiceConfigurer, label="lamp", params=params)) as link:
        answers = await asyncio.gather(
            *(link.connection.request("lamp", {"data": value}, timeout_s=10) for value in (True, False))
        )
    assert [one["message"] for one in answers] == ["lamp True", "lamp False"]


def test_a_latched_message_of_ours_waits_for_who_comes_later(ros: ZenohRos, here: dict[str, Any]) -> None:
    shared = Shared()
    params = {**here, "topic": "/goal", "type": "std_msgs/msg/Bool", "qos": "latched"}
    handler: Any = build(Ros2PublisherConfigurer, params=params, shared=shared)
    with shared.entered():
        wait_for(lambda: not feed(handler, [{"data": True}]).refused, "it is published")
        listening = {**here, "topic": "/goal", "type": "std_msgs/msg/Bool", "silence_s": 600}
        assert first_told(listening) == [{"data": True}]


async def test_a_service_of_another_type_or_of_nobody_is_refused(
    ros: ZenohRos, here: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(zenoh_service, "MATCH_S", 0.5)
    ros.server("/lamp", "std_srvs/srv/SetBool", lambda ask: {})
    for name, said in (("/lamp", "write `type: std_srvs/srv/SetBool`"), ("/nobody", "no server of /nobody")):
        params = {**here, "service": name, "type": "std_srvs/srv/Trigger"}
        async with joined(connector(Ros2ServiceConfigurer, label="lamp", params=params)) as link:
            with pytest.raises(Exception, match=said):
                await link.connection.request("lamp", {}, timeout_s=10)


def test_without_a_router_it_is_told_how_to_start_one() -> None:
    params = {"transport": "zenoh", "peers": [f"tcp/127.0.0.1:{free_port()}"], "topic": "/a", "type": "std_msgs/Bool"}
    with pytest.raises(DeviceGone, match="rmw_zenohd"):
        collect(build(Ros2TopicConfigurer, params=params), 1)


def test_the_commands_hear_it_too(ros: ZenohRos) -> None:
    ros.publisher("/scan", "sensor_msgs/msg/LaserScan")
    ros.token("MP", "/map", "nav_msgs/msg/OccupancyGrid", "RIHS01_x", ":1:,1:,:,:,,")
    words = ["ros2", "topics", "--transport", "zenoh", "--domain", str(DOMAIN), "--peer", ros.router, "--wait", "0.5"]
    said = CliRunner().invoke(app, words).output
    assert "best effort, volatile" in said
    assert "reliable, transient local" in said


def test_profiles_differ_as_their_tokens_do() -> None:
    one, other = (HeardEndpoint("/a", "std_msgs/msg/Bool", "publisher", qos) for qos in (SENSOR, LATCHED))
    assert token_of(0, "s", 1, one, "H").endswith("/2::,5:,:,:,,")
    assert token_of(0, "s", 1, other, "H").endswith("/:1:,1:,:,:,,")
