"""Original robots and pages on libdatachannel (npm's node-datachannel) against ours: data, as it codes no pictures."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import pytest

from mosaic_core.operator import ConnectionCheckingStore, MosaicOperator, ReceivableStore, RobotConnector, SendableStore
from mosaic_core.words.data_type import MosaicDataType

pytestmark = [pytest.mark.webrtc, pytest.mark.timeout(90)]
FORWARD = json.dumps({"linear": {"x": 0.3, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": 0.1}})


@pytest.fixture
def tab(libdatachannel: Any, server: Any, seed: Any) -> Iterator[Any]:
    page = libdatachannel.make("Page", server.url)
    page("logIn", seed.email, seed.password)
    yield page
    page("close")


@pytest.fixture
def robot(libdatachannel: Any, server: Any, new_robot: Any) -> Iterator[Any]:
    """An original robot; `robot.id` is its own."""
    peer = libdatachannel.make("Robot", server.url)
    peer.id, token = new_robot("libdatachannel")
    peer("start", peer.id, token)
    yield peer
    peer("close")


def test_an_original_page_on_libdatachannel_drives_our_robot(
    pair: Any, tab: Any, seed: Any, our_robot: Any, wait_for: Any
) -> None:
    pair("our robot", "original page on libdatachannel", "data, commands, connection check, hanging up")
    tab("waitReady", seed.robot_id)
    call = tab("call", seed.robot_id, ["pose", "cmd_vel", "link-sender", "link-receiver"])
    wait_for(lambda: len(tab("received", call, "pose")) > 2, "poses")
    before = json.loads(tab("received", call, "pose")[-1])["position"]
    tab("send", call, "cmd_vel", FORWARD)
    assert tab("check", call) < 500

    def moved() -> bool:
        tab("send", call, "cmd_vel", FORWARD)
        now = json.loads(tab("received", call, "pose")[-1])["position"]
        return abs(now["x"] - before["x"]) + abs(now["y"] - before["y"]) > 0.05

    wait_for(moved, "the base moves")
    tab("hangUp", call)
    tab("waitReady", seed.robot_id)


def test_our_python_operator_works_with_an_original_robot_on_libdatachannel(
    pair: Any, server: Any, seed: Any, robot: Any, in_thread: Any, until: Any
) -> None:
    pair("our Python operator", "original robot on libdatachannel", "data, commands, connection check")

    async def scene() -> None:
        async with await MosaicOperator.login(server.url, seed.email, seed.password) as operator:
            pose = RobotConnector(robot.id, "pose", MosaicDataType.JSON_R2U)
            twist = RobotConnector(robot.id, "cmd_vel", MosaicDataType.JSON_U2R)
            link = RobotConnector(robot.id, "link", MosaicDataType.JSON_BI)
            check = operator.stores.get_or_create_store(link, ConnectionCheckingStore)
            connection = await operator.connect(robot.id, connectors=[pose, twist], timeout_s=20)
            heard, said = operator.stores.get_or_create_store(pose), operator.stores.get_or_create_store(twist)
            assert isinstance(heard, ReceivableStore)
            assert isinstance(said, SendableStore)
            assert json.loads((await heard.next_message(20)).data)["position"]["y"] == 1.5
            await said.wait_open(20)
            assert said.send_json(json.loads(FORWARD))
            await until(lambda: robot("look")["twists"] == [[0.3, 0.1]], "the twist")
            await until(lambda: check.round_trip_ms is not None, "the check")
            await connection.close()
            await until(lambda: robot("look")["state"] == 0, "the robot is free")

    in_thread(scene())


def test_an_original_robot_and_an_original_page_on_libdatachannel_meet_on_our_server(
    pair: Any, tab: Any, robot: Any, wait_for: Any
) -> None:
    pair("our server", "original robot and page on libdatachannel", "a whole session, simple token")
    tab("waitReady", robot.id)
    # A robot that reaches libdatachannel while it still reads the answer is taken for a forger: it looks for the
    # fingerprint before it has kept it. In one process with its robot that happens.
    call = tab("call", robot.id, ["pose", "cmd_vel", "link-sender", "link-receiver"], {"hides": True})
    wait_for(lambda: len(tab("received", call, "pose")) > 2, "poses")
    tab("send", call, "cmd_vel", FORWARD)
    tab("check", call)
    assert robot("look")["twists"] == [[0.3, 0.1]]
    tab("hangUp", call)
    wait_for(lambda: robot("look")["statuses"] == [0, 1, 2, 3, 0], "the robot is free")
