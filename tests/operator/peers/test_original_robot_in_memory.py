"""The headless operator at a robot that says no hello and announces nothing; the server may keep a description."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Sequence
from typing import Any

import pytest

from mosaic_core.machines.peers import peer_of_operator as operator_peer
from mosaic_core.operator import (
    ConnectionCheckingStore,
    LeaseDenied,
    MediaStreamStore,
    ReceivableStore,
    RobotConnector,
    SendableStore,
    UnknownLabel,
)
from mosaic_core.words import signaling
from mosaic_core.words.data_type import MosaicDataType
from mosaic_core.words.described import DescribedConnector
from mosaic_core.words.errors import ConnectionFailed

WAIT_S = 30.0
ROWS = [
    {"connectorId": "odom", "connectorType": "JsonReceivableStore", "params": {}},
    {"connectorId": "front", "connectorType": "MediaStreamStore", "params": {}},
    {"connectorId": "rear", "connectorType": "opencv-sender-camera", "params": {}},
    {"connectorId": "cloud", "connectorType": "PointCloudStore", "params": {"parallelNum": 2}},
    {"connectorId": "link-receiver", "connectorType": "ConnectionCheckSenderStore", "params": {}},
    {"connectorId": "link-sender", "connectorType": "ConnectionCheckReceiverStore", "params": {}},
    {"connectorId": "wheels", "connectorType": "ThumbstickToTwistStore", "params": {}},
    {"connectorId": "teleop", "connectorType": "turtlebot-receiver-teleop", "params": {}},
]


@pytest.fixture(autouse=True)
def quickly(monkeypatch: pytest.MonkeyPatch) -> None:
    """In memory a hello needs no two seconds to come, or not to."""
    monkeypatch.setattr(operator_peer, "HELLO_TIMEOUT_S", 0.1)


@pytest.fixture
def original(world: Any) -> Any:
    """An original robot behind an original server that keeps a description of it."""
    world.server.extensions = None
    world.robot.is_ours = False
    world.server.connector_config = json.dumps({"connectors": ROWS})
    return world


@pytest.fixture
def untold(original: Any) -> Any:
    """The same, of which nobody wrote anything down."""
    original.server.connector_config = None
    return original


def offers(world: Any) -> int:
    return sum(isinstance(message, signaling.SdpOffer) for message in world.server.received)


def echoes(world: Any, label: str) -> None:
    """The robot's half of a connection check: it sends back verbatim."""
    world.robot.channels[f"{label}-receiver"].sent = lambda _, data: world.robot.channels[f"{label}-sender"].on_message(
        data
    )


async def test_what_people_wrote_down_is_the_catalogue(original: Any) -> None:
    async with original.operator() as operator:
        connection = await operator.connect(original.robot_id, timeout_s=WAIT_S)
        assert connection.is_original
        assert connection.catalogue is not None
        labels = [entry.label for entry in connection.catalogue.entries]
        assert labels == ["odom", "front", "rear", "cloud", "link", "wheels", "teleop"]
        store = connection.receivable("odom")
        await store.wait_open(WAIT_S)
        waiting = asyncio.create_task(store.next_message(WAIT_S))
        await asyncio.sleep(0)
        original.robot.channels["odom"].on_message('{"x": 1}')
        assert (await waiting).json() == {"x": 1}
        assert isinstance(connection.media("rear"), MediaStreamStore)


async def test_a_label_that_nobody_described_names_the_nearest_and_what_to_do(original: Any) -> None:
    async with original.operator() as operator:
        connection = await operator.connect(original.robot_id, timeout_s=WAIT_S)
        with pytest.raises(UnknownLabel, match="did you mean 'odom'") as unknown:
            connection.receivable("odm")
        assert "data-type" in unknown.value.cure
        assert isinstance(connection.receivable("odm", "json-r2u"), ReceivableStore)


async def test_the_data_type_of_the_caller_counts_more_than_what_was_written_down(original: Any) -> None:
    async with original.operator() as operator:
        connection = await operator.connect(original.robot_id, timeout_s=WAIT_S)
        assert isinstance(connection.sendable("odom", "json-u2r"), SendableStore)


@pytest.mark.parametrize("data_type", ["json-r2u", MosaicDataType.JSON_R2U])
async def test_a_data_type_is_taken_as_text_too(untold: Any, data_type: str) -> None:
    connector = RobotConnector(untold.robot_id, "odom", data_type)
    assert connector == RobotConnector(untold.robot_id, "odom", MosaicDataType.JSON_R2U)

    async with untold.operator() as operator:
        await operator.connect(untold.robot_id, connectors=[connector], timeout_s=WAIT_S)
        assert isinstance(operator.stores.get_or_create_store(connector), ReceivableStore)


def test_a_misspelt_data_type_names_the_nearest() -> None:
    with pytest.raises(ConnectionFailed, match="did you mean 'json-r2u'") as unknown:
        RobotConnector("r", "odom", "json-r2")
    assert unknown.value.code == "channel.unknown_data_type"


async def test_of_a_robot_that_nobody_described_a_label_alone_is_an_error_with_its_cure(untold: Any) -> None:
    async with untold.operator() as operator:
        odom = RobotConnector(untold.robot_id, "odom")
        with pytest.raises(ConnectionFailed, match="name its data type") as unknown:
            await operator.connect(untold.robot_id, connectors=[odom], timeout_s=WAIT_S)
        assert unknown.value.cure
        assert untold.robot.is_closed


async def test_the_channels_of_a_point_cloud_are_one_store(original: Any) -> None:
    async with original.operator() as operator:
        connection = await operator.connect(original.robot_id, timeout_s=WAIT_S)
        got: list[bytes] = []
        store = connection.receivable("cloud")
        store.subscribe(got.append)
        await store.wait_open(WAIT_S)
        original.robot.channels["cloud-0"].on_message(b"a")
        original.robot.channels["cloud-1"].on_message(b"b")
        assert got == [b"a", b"b"]


async def test_a_program_may_describe_a_connector_itself(untold: Any) -> None:
    check = DescribedConnector(connector_id="link", connector_type="connection-check")

    async with untold.operator() as operator:
        await operator.connect(untold.robot_id, described=[check], timeout_s=WAIT_S)
        store = operator.stores.get_or_create_store(RobotConnector(untold.robot_id, "link"))
        assert isinstance(store, ConnectionCheckingStore)


# -- the check of the connection -----------------------------------------------------------------------------------


@pytest.mark.parametrize("is_described", [True, False])
async def test_the_connection_check_works_on_an_original_robot(original: Any, is_described: bool) -> None:
    if not is_described:
        original.server.connector_config = None

    async with original.operator() as operator:
        connection = await operator.connect(original.robot_id, timeout_s=WAIT_S)
        store = connection.connection_check("link")
        await store.wait_open(WAIT_S)
        echoes(original, "link")
        assert isinstance(await store.next_message(WAIT_S), object)
        assert store.round_trip_ms is not None


@pytest.mark.parametrize("is_ours", [True, False])
async def test_a_connection_check_may_be_asked_for_before_anything_is_known(world: Any, is_ours: bool) -> None:
    world.server.extensions = None  # nobody announces anything before the robot itself
    world.robot.is_ours = is_ours

    async with world.operator() as operator:
        link = RobotConnector(world.robot_id, "link")
        store = operator.stores.get_or_create_store(link, ConnectionCheckingStore)
        await operator.connect(world.robot_id, timeout_s=WAIT_S)
        await store.wait_open(WAIT_S)
        assert {"link-receiver", "link-sender"} <= set(world.robot.channels)
        assert operator.stores.get_or_create_store(link) is store


async def test_a_check_of_what_is_none_says_so(world: Any) -> None:
    async with world.operator() as operator:
        connector = RobotConnector(world.robot_id, "battery")
        store = operator.stores.get_or_create_store(connector, ConnectionCheckingStore)
        await operator.connect(world.robot_id, timeout_s=WAIT_S)
        with pytest.raises(ConnectionFailed, match="no connection-check"):
            await store.wait_open(WAIT_S)


# -- cameras -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("named", "lines"),
    [((), ["front", "rear"]), (("odom",), []), (("rear",), ["front", "rear"]), (("roof",), ["front", "rear", "roof"])],
)
async def test_all_described_cameras_have_a_line_unless_the_caller_wants_none(
    original: Any, named: Sequence[str], lines: list[str]
) -> None:
    data_types = {"odom": None, "rear": None, "roof": "media"}
    connectors = [RobotConnector(original.robot_id, label, data_types[label]) for label in named]

    async with original.operator() as operator:
        await operator.connect(original.robot_id, connectors=connectors, timeout_s=WAIT_S)
        assert list(original.robot.videos) == lines


async def test_a_camera_that_is_asked_for_too_late_is_refused_at_once_with_the_cure(untold: Any) -> None:
    async with untold.operator() as operator:
        connection = await operator.connect(untold.robot_id, timeout_s=WAIT_S)
        store = operator.stores.get_or_create_store(RobotConnector(untold.robot_id, "front", "media"))
        assert store.state.code == "media.no_line"
        for waiting in (store.wait_open(WAIT_S), store.next_image(WAIT_S)):
            with pytest.raises(ConnectionFailed) as refused:
                await waiting
            assert refused.value.code == "media.no_line"
            assert "may_break" in refused.value.cure
        assert connection.state == "connected"
        assert offers(untold) == 1


async def test_who_waits_for_a_picture_hears_that_none_will_come(original: Any) -> None:
    async with original.operator() as operator:
        store = operator.stores.get_or_create_store(RobotConnector(original.robot_id, "front", "media"))
        waiting = asyncio.create_task(store.next_frame(WAIT_S))
        await asyncio.sleep(0)
        store.failed(ConnectionFailed("no line", code="media.no_line"))
        with pytest.raises(ConnectionFailed, match="no line"):
            await waiting


async def test_where_a_break_is_allowed_the_late_camera_gets_its_line_and_the_rest_comes_back(untold: Any) -> None:
    wheels = DescribedConnector(connector_id="wheels", connector_type="ros2-receiver-geometry-Twist")

    async with untold.operator() as operator:
        connection = await operator.connect(untold.robot_id, described=[wheels], may_break=True, timeout_s=WAIT_S)
        pad = connection.sendable("wheels")
        await pad.wait_open(WAIT_S)
        assert pad.send_json({"linear": {"x": 1}})
        before = untold.robot.channels["wheels"]
        cameras = [
            operator.stores.get_or_create_store(RobotConnector(untold.robot_id, label, "media"))
            for label in ("front", "rear")
        ]
        for camera in cameras:
            await camera.wait_open(WAIT_S)
        assert list(untold.robot.videos) == ["front", "rear"]
        assert json.loads(before.from_operator[-1])["linear"] == {"x": 0, "y": 0, "z": 0}
        await pad.wait_open(WAIT_S)
        assert (connection.state, offers(untold)) == ("connected", 2)


async def test_a_robot_that_gives_the_line_to_another_camera_is_not_asked_again(untold: Any) -> None:
    """Original robots give their cameras out in the order of their file."""
    robot, connect = untold.robot, untold.robot._connect

    def mislabelled() -> None:
        robot.videos = {"front": robot.videos["rear"]}
        connect()

    robot._connect = mislabelled
    async with untold.operator() as operator:
        rear = RobotConnector(untold.robot_id, "rear", "media")
        await operator.connect(untold.robot_id, connectors=[rear], may_break=True, timeout_s=WAIT_S)
        store = operator.stores.get_or_create_store(rear)
        with pytest.raises(ConnectionFailed, match="it sends 'front'"):
            await store.wait_open(WAIT_S)
        assert offers(untold) == 1


# -- no stop -------------------------------------------------------------------------------------------------------


async def test_the_stop_says_that_there_is_none_and_zeros_go_to_what_is_known_to_drive(original: Any) -> None:
    async with original.operator() as operator:
        connection = await operator.connect(original.robot_id, timeout_s=WAIT_S)
        with pytest.raises(ConnectionFailed) as none:
            await connection.control.stop()
        assert none.value.code == "safety.no_stop"
        report = await connection.send_zeros()
        assert (report.arrived, report.failed) == (("wheels", "teleop"), ())
        assert report.is_complete
        channels = original.robot.channels
        zero = {"linear": {"x": 0, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": 0}}
        assert json.loads(channels["wheels"].from_operator[-1]) == zero
        assert json.loads(channels["teleop"].from_operator[-1]) == {"linear_x": 0, "angular_z": 0}


async def test_zeros_that_are_not_acknowledged_count_as_failed(original: Any) -> None:
    async with original.operator() as operator:
        connection = await operator.connect(original.robot_id, timeout_s=WAIT_S)
        wheels = connection.sendable("wheels")
        await wheels.wait_open(WAIT_S)
        original.robot.channels["wheels"].under_way_bytes = 60
        report = await connection.send_zeros()
        assert (report.arrived, report.failed) == (("teleop",), ("wheels",))
        assert not report.is_complete


async def test_where_no_drive_is_known_nothing_is_sent_and_nothing_is_claimed(untold: Any) -> None:
    async with untold.operator() as operator:
        connection = await operator.connect(untold.robot_id, timeout_s=WAIT_S)
        report = await connection.send_zeros()
        assert (report.arrived, report.failed, report.is_complete) == ((), (), False)


async def test_a_robot_of_ours_is_sent_no_zeros_behind_its_stop(world: Any) -> None:
    async with world.operator() as operator:
        connection = await operator.connect(world.robot_id, timeout_s=WAIT_S)
        assert (await connection.send_zeros()).arrived == ()
        assert "cmd_vel" not in world.robot.channels


# -- the end of a connection ---------------------------------------------------------------------------------------

ZERO = {"linear": {"x": 0, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": 0}}


def messages(world: Any, label: str) -> list[Any]:
    return [json.loads(text) for text in world.robot.channels[label].from_operator]


@pytest.mark.parametrize("closes", [True, False])
async def test_an_orderly_end_leaves_standing_what_was_commanded_and_nothing_else(original: Any, closes: bool) -> None:
    async with original.operator() as operator:
        connection = await operator.connect(original.robot_id, timeout_s=WAIT_S)
        pad = connection.sendable("wheels")
        await pad.wait_open(WAIT_S)
        assert pad.send_json({"linear": {"x": 0.2}})
        if closes:
            await connection.close()
            assert not pad.send_json({"linear": {"x": 0.2}})
    assert messages(original, "wheels") == [{"linear": {"x": 0.2}}, ZERO]
    assert "teleop" not in original.robot.channels


async def test_an_end_after_a_zero_sends_no_second_one(original: Any) -> None:
    async with original.operator() as operator:
        connection = await operator.connect(original.robot_id, timeout_s=WAIT_S)
        pad = connection.sendable("wheels")
        await pad.wait_open(WAIT_S)
        assert pad.send_json(ZERO)
    assert messages(original, "wheels") == [ZERO]


async def test_a_drive_whose_store_was_released_is_left_standing_too(original: Any, monkeypatch: Any) -> None:
    monkeypatch.setattr("mosaic_core.operator.stores.store_manager.LINGER_S", 0.0)

    async with original.operator() as operator:
        connection = await operator.connect(original.robot_id, timeout_s=WAIT_S)
        pad = connection.sendable("wheels")
        await pad.wait_open(WAIT_S)
        assert pad.send_json({"linear": {"x": 0.2}})
        released = asyncio.Event()
        pad.on_after_disconnected(released.set)
        operator.stores.release_store(pad.robot_connector)
        await released.wait()
    assert messages(original, "wheels") == [ZERO]  # on a channel of its own


async def test_a_task_that_goes_on_commanding_does_not_get_behind_the_last_zero(original: Any) -> None:
    async with original.operator() as operator:
        connection = await operator.connect(original.robot_id, timeout_s=WAIT_S)
        pad = connection.sendable("wheels")
        await pad.wait_open(WAIT_S)

        async def command() -> None:
            while True:
                pad.send_json({"linear": {"x": 0.2}})
                await asyncio.sleep(0)

        commanding = asyncio.create_task(command())
        await asyncio.sleep(0)
    commanding.cancel()
    assert messages(original, "wheels")[-1] == ZERO


async def test_an_end_waits_no_longer_than_half_a_second_for_a_robot_that_is_silent(original: Any, caplog: Any) -> None:
    async with original.operator() as operator:
        connection = await operator.connect(original.robot_id, timeout_s=WAIT_S)
        pad = connection.sendable("wheels")
        await pad.wait_open(WAIT_S)
        original.robot.channels["wheels"].acknowledges = False
        assert pad.send_json({"linear": {"x": 0.2}})
        begun_s = asyncio.get_running_loop().time()
        await connection.close()
        assert asyncio.get_running_loop().time() - begun_s < 2.0
        assert original.robot.is_closed
    assert "the robot may go on" in caplog.text


async def test_a_lease_of_an_original_robot_is_denied_with_what_to_do_instead(original: Any) -> None:
    async with original.operator() as operator:
        connection = await operator.connect(original.robot_id, timeout_s=WAIT_S)
        with pytest.raises(LeaseDenied, match="original MOSAIC") as denied:
            await connection.control.take()
        assert denied.value.code == "lease.unknown_resource"
        assert "is_original" in denied.value.cure
        with pytest.raises(LeaseDenied):
            connection.control.answer("somebody", grant=True)
        with pytest.raises(ConnectionFailed) as none:
            await connection.control.journal()
        assert none.value.cure


@pytest.mark.parametrize(("ask", "right"), [("sendable", "json-u2r"), ("receivable", "json-r2u")])
async def test_the_cure_of_an_unknown_label_names_the_data_type_of_the_store(untold: Any, ask: str, right: str) -> None:
    async with untold.operator() as operator:
        connection = await operator.connect(untold.robot_id, timeout_s=WAIT_S)
        with pytest.raises(ConnectionFailed) as unknown:
            getattr(connection, ask)("what")
        assert f"'{right}'" in unknown.value.cure
        assert "dashboard" in unknown.value.cure
