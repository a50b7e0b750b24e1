"""Original robots and pages on aiortc alone against ours."""

from __future__ import annotations

import asyncio
import json
import time
from typing import Any

import numpy as np
import pytest
from independent.point_cloud import CloudStore

from mosaic_core.operator import (
    ConnectionCheckingStore,
    MediaStreamStore,
    MosaicOperator,
    ReceivableStore,
    RobotConnector,
    SendableStore,
)
from mosaic_core.words.data_type import MosaicDataType
from mosaic_core.words.errors import ConnectionFailed
from mosaic_core.words.signaling import RobotStatus

pytestmark = [pytest.mark.webrtc, pytest.mark.timeout(90)]

PAGE, C2, C1 = "original page on aiortc", "original robot (C2) on aiortc", "original robot (C1)"
ROBOT, SERVER, OPERATOR = "our robot", "our server", "our Python operator"
FORWARD = json.dumps({"linear": {"x": 0.3, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": 0.1}})
FIRST_PICTURE_S = 2.0
"""On a busy machine, too; one that is not known as an original page at once sees nothing for 2.2 s."""


async def differ(track: Any) -> float:
    """Share of pixels that changed over eight pictures: a moving picture, neither black nor a still."""
    pictures = [(await asyncio.wait_for(track.recv(), 20)).to_ndarray(format="gray").astype(int) for _ in range(8)]
    return float((np.abs(pictures[-1] - pictures[0]) > 15).mean())


async def test_data_commands_and_the_check_of_an_original_page_on_our_robot(
    pair: Any, page: Any, seed: Any, our_robot: Any, until: Any
) -> None:
    pair(ROBOT, PAGE, "data, commands, connection check, hanging up")

    async with page() as tab:
        await tab.wait_ready(seed.robot_id)
        call = await tab.call(seed.robot_id, ("pose", "cmd_vel", "link-sender", "link-receiver", "unknown"))
        assert call.rejected_candidates == 0
        await until(lambda: len(call.objects("pose")) > 2, "poses")
        assert await call.check() < 500
        before = call.objects("pose")[-1]["position"]
        for _ in range(8):
            call.channels["cmd_vel"].send(FORWARD)
            await asyncio.sleep(0.1)  # the pace of a held stick
        after = call.objects("pose")[-1]["position"]
        assert abs(after["x"] - before["x"]) + abs(after["y"] - before["y"]) > 0.05
        await call.hang_up()
        await tab.wait_ready(seed.robot_id)


async def test_an_original_page_sees_our_camera_move(
    pair: Any, page: Any, seed: Any, our_robot: Any, until: Any
) -> None:
    pair(ROBOT, PAGE, "a camera beside data")

    async with page() as tab:
        await tab.wait_ready(seed.robot_id)
        call = await tab.call(seed.robot_id, ("pose",), videos=1)
        assert call.streams == ["front"]
        assert await differ(call.tracks[0]) > 0.001
        await until(lambda: call.objects("pose"), "a pose")


async def test_an_original_page_gathers_our_point_cloud(
    pair: Any, page: Any, seed: Any, our_robot: Any, until: Any
) -> None:
    pair(ROBOT, PAGE, "a point cloud as protobuf on the channel `cloud-0`")

    async with page() as tab:
        await tab.wait_ready(seed.robot_id)
        call = await tab.call(seed.robot_id, ("cloud-0",))
        await until(lambda: len(call.received["cloud-0"]) > 5, "clouds")
        store = CloudStore()
        for message in call.received["cloud-0"]:
            store.take(message)
        assert store.clouds
        cloud = store.clouds[0]
        assert len(cloud) > 1000
        assert np.isfinite(cloud).all()
        assert np.linalg.norm(cloud[:, :3], axis=1).max() < 20, "the room of the simulation"


@pytest.mark.parametrize("labels", [("pose",), ()], ids=["with_data", "pictures_alone"])
async def test_an_original_page_sees_the_first_picture_at_once(
    pair: Any, page: Any, seed: Any, our_robot: Any, labels: tuple[str, ...]
) -> None:
    pair(ROBOT, PAGE, f"the first picture within {FIRST_PICTURE_S} s, {'beside data' if labels else 'pictures alone'}")

    async with page() as tab:
        await tab.wait_ready(seed.robot_id)
        call = await tab.call(seed.robot_id, labels, videos=1)
        connected_s = time.monotonic()
        await asyncio.wait_for(call.tracks[0].recv(), 20)
        assert time.monotonic() - connected_s < FIRST_PICTURE_S


async def test_an_original_page_shows_our_robot_from_its_connector_config(
    pair: Any, page: Any, seed: Any, our_robot: Any, until: Any
) -> None:
    pair("our robot on our server", PAGE, "`connectorConfig` names every connector, and all of them work")

    async with page() as tab:
        await tab.wait_ready(seed.robot_id)
        call = await tab.call_as_configured(seed.robot_id)
        assert call.streams == ["front"]
        assert await differ(call.tracks[0]) > 0.001
        await until(lambda: call.objects("pose"), "a pose")
        await call.check()
        call.channels["cmd_vel"].send(FORWARD)


@pytest.mark.parametrize("with_token", [True, False], ids=["token", "no_token"])
async def test_an_original_robot_and_an_original_page_meet_on_our_server(
    pair: Any, page: Any, c2_robot: Any, until: Any, with_token: bool
) -> None:
    pair(SERVER, f"{C2} and {PAGE}", f"a whole session, {'simple token' if with_token else 'no authorization'}")

    async with c2_robot(with_token=with_token, cameras=("front",)) as robot, page() as tab:
        await tab.wait_ready(robot.robot_id)
        call = await tab.call(robot.robot_id, ("pose", "cmd_vel", "link-sender", "link-receiver"), videos=1)
        await until(lambda: len(call.objects("pose")) > 2, "poses")
        call.channels["cmd_vel"].send(FORWARD)
        await until(lambda: robot.twists == [(0.3, 0.1)], "the twist")
        await call.check()
        assert call.streams == ["front"]
        assert await differ(call.tracks[0]) > 0.01
        await until(lambda: tab.statuses(robot.robot_id)[-1] == 2, "the page hears that it is connected")
        await call.hang_up()
        await until(lambda: robot.statuses[-1] == 0, "the robot is free")
        assert robot.statuses == [0, 1, 2, 3, 0]


async def test_an_original_robot_is_called_again_and_answers_pings(
    pair: Any, page: Any, c2_robot: Any, until: Any
) -> None:
    pair(SERVER, C2, "pings, status, a second call, its going away")

    async with page() as tab:
        async with c2_robot() as robot:
            for _ in range(2):
                await tab.wait_ready(robot.robot_id)
                call = await tab.call(robot.robot_id, ("pose",))
                await until(lambda: call.objects("pose"), "a pose")  # noqa: B023
                await call.hang_up()
                await until(lambda: robot.state == 0, "the robot is free")
            await until(lambda: robot.pings, "a ping of the server", 30)
            await until(lambda: tab.pings, "a ping of the page", 30)
        await until(lambda: tab.statuses(robot.robot_id)[-1] == 5, "the page hears that it went")


async def test_a_c1_robot_is_listed_and_its_status_is_shown(pair: Any, page: Any, c1_robot: Any, until: Any) -> None:
    pair(SERVER, C1, "listed and monitored (it cannot answer an offer)")

    async with c1_robot() as robot, page() as tab:
        await tab.wait_ready(robot.robot_id)
        assert next(it for it in await tab.rest.robots() if it["id"] == robot.robot_id)["status"] == 0
        await robot.shut()
        await until(lambda: tab.statuses(robot.robot_id)[-1] == 5, "the page hears that it went")


async def operator_of(server: Any, seed: Any) -> MosaicOperator:
    return await MosaicOperator.login(server.url, seed.email, seed.password)


def connectors_of(robot_id: str) -> dict[str, RobotConnector]:
    """What a program must say about a robot that does not say it itself."""
    types = {
        "pose": MosaicDataType.JSON_R2U,
        "cmd_vel": MosaicDataType.JSON_U2R,
        "link": MosaicDataType.JSON_BI,
        "front": MosaicDataType.MEDIA,
    }
    return {label: RobotConnector(robot_id, label, data_type) for label, data_type in types.items()}


async def test_our_python_operator_works_with_an_original_robot(
    pair: Any, server: Any, seed: Any, c2_robot: Any, until: Any
) -> None:
    pair(OPERATOR, C2, "data, commands, connection check, a camera")

    async with c2_robot(cameras=("front",)) as robot, await operator_of(server, seed) as operator:
        known = connectors_of(robot.robot_id)
        check = operator.stores.get_or_create_store(known["link"], ConnectionCheckingStore)
        named = [known[label] for label in ("pose", "cmd_vel", "front")]
        connection = await operator.connect(robot.robot_id, connectors=named, timeout_s=20)
        assert connection.is_original
        pose, twist, front = map(operator.stores.get_or_create_store, named)
        assert isinstance(pose, ReceivableStore)
        assert isinstance(twist, SendableStore)
        assert isinstance(front, MediaStreamStore)
        assert json.loads((await pose.next_message(20)).data)["position"]["y"] == 1.5
        await twist.wait_open(20)
        assert twist.send_json(json.loads(FORWARD))
        await until(lambda: robot.twists == [(0.3, 0.1)], "the twist")
        assert isinstance(robot.twist_texts[0], str), "the original writes JSON as text"
        await until(lambda: check.round_trip_ms is not None, "the check")
        first = (await front.next_image(20)).astype(int)
        async with asyncio.timeout(20):
            while not (np.abs((await front.next_image(20)).astype(int) - first) > 60).any():
                pass
        await connection.close()
        await until(lambda: robot.state == 0, "the robot is free")


async def test_a_c1_robot_that_never_answers_is_told_as_such(pair: Any, server: Any, seed: Any, c1_robot: Any) -> None:
    pair(OPERATOR, C1, "a call ends with a reason instead of waiting for ever")

    async with c1_robot() as robot, await operator_of(server, seed) as operator:
        await operator.wait_status(robot.robot_id, RobotStatus.READY_TO_CONNECT)
        with pytest.raises(ConnectionFailed) as failure:
            await operator.connect(robot.robot_id, timeout_s=6)
        assert failure.value.code.startswith("signal."), failure.value
