"""Server and robot in processes of their own, operators over real WebRTC: what a user relies on, without a browser."""

from __future__ import annotations

import asyncio
import json
import math
import time
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from mosaic_core.operator import MosaicOperator, RobotConnection
from mosaic_core.words.errors import AuthError, ConnectionFailed
from mosaic_core.words.signaling import RobotStatus

pytestmark = [pytest.mark.webrtc, pytest.mark.timeout(180)]

COLOURS_BGR = [(200, 40, 40), (40, 200, 40), (40, 40, 200), (200, 200, 40)]
TWIST = {"linear": {"x": 0.4}, "angular": {"z": 0.6}}


@pytest.fixture(scope="module")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two seconds of video: each half second of another colour, so that a frame's content tells its place."""
    path = tmp_path_factory.mktemp("clip") / "colours.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 20, (320, 240))
    for colour in COLOURS_BGR:
        for _ in range(10):
            writer.write(np.full((240, 320, 3), colour, np.uint8))
    writer.release()
    return path


@pytest.fixture(scope="module")
def robot(start_robot: Any, clip: Path) -> Any:
    return start_robot(
        f"""\
  - {{ type: camera, label: film, params: {{ source: {clip} }} }}
  - {{ type: sim-pose, label: pose, params: {{ period_s: 0.02 }} }}
  - {{ type: sim-battery, label: battery }}
  - {{ type: host-load, label: host, params: {{ period_s: 0.2 }} }}
  - {{ type: cmd-vel, label: cmd_vel, params: {{ drive: {{ type: sim }} }}, safety: {{ timeout_s: 0.3 }} }}
  - {{ type: connection-check, label: link }}
"""
    )


class Site:
    """Signs operators in; each is closed at the end of the test."""

    def __init__(self, server: Any, seed: Any, stack: AsyncExitStack) -> None:
        self.server, self.seed, self.stack = server, seed, stack

    async def operator(self) -> MosaicOperator:
        operator = await MosaicOperator.login(self.server.url, self.seed.email, self.seed.password)
        return await self.stack.enter_async_context(operator)

    async def connected(self) -> RobotConnection:
        return await (await self.operator()).connect(self.seed.robot_id, timeout_s=20)


@pytest.fixture
async def site(server: Any, seed: Any, robot: Any) -> AsyncIterator[Site]:
    async with AsyncExitStack() as stack:
        yield Site(server, seed, stack)


async def pose_of(connection: RobotConnection) -> tuple[float, float]:
    pose = json.loads((await connection.receivable("pose").next_message()).data)
    return pose["position"]["x"], pose["position"]["y"]


async def until_it_rests(connection: RobotConnection, timeout_s: float = 5.0) -> None:
    """Until five looks in a row show the same place."""
    async with asyncio.timeout(timeout_s):
        place, same = await pose_of(connection), 0
        while same < 5:
            now = await pose_of(connection)
            same = same + 1 if math.dist(place, now) < 0.0005 else 0
            place = now


async def drive_until_it_moves(connection: RobotConnection) -> None:
    pad = connection.sendable("cmd_vel")
    await pad.wait_open()
    await connection.control.take()
    start = await pose_of(connection)
    async with asyncio.timeout(30):
        while math.dist(start, await pose_of(connection)) < 0.05:
            assert pad.send_json(TWIST)


async def test_the_frames_of_a_video_file_arrive_by_content(site: Site) -> None:
    film = (await site.connected()).media("film")
    seen: set[int] = set()
    async with asyncio.timeout(20):
        while len(seen) < len(COLOURS_BGR):
            image = await film.next_image()
            assert image.shape == (240, 320, 3)
            mean = image.reshape(-1, 3).mean(axis=0)
            distances = [float(np.abs(mean - colour).max()) for colour in COLOURS_BGR]
            if min(distances) < 25:
                seen.add(distances.index(min(distances)))


async def test_sensor_messages_arrive_with_their_age(site: Site) -> None:
    connection = await site.connected()
    host = json.loads((await connection.receivable("host").next_message()).data)
    assert 0 <= host["cpu_percent"] <= 100
    battery = json.loads((await connection.receivable("battery").next_message()).data)
    assert 0 < battery["percent"] <= 100


async def test_commands_move_the_base_and_silence_stops_it(site: Site) -> None:
    connection = await site.connected()
    await drive_until_it_moves(connection)
    await until_it_rests(connection)


async def test_a_command_that_is_not_a_number_is_refused_with_a_reason(site: Site) -> None:
    connection = await site.connected()
    refusals: asyncio.Queue[Any] = asyncio.Queue()
    connection.on_refusal(refusals.put_nowait)
    pad = connection.sendable("cmd_vel")
    await pad.wait_open()
    await connection.control.take()
    start = await pose_of(connection)
    for bad in ('{"linear":{"x":"fast"}}', "{}", "[1]", "not json", '{"linear":{"x":NaN}}'):
        async with asyncio.timeout(30):
            while refusals.empty():  # the same refusal is told twice a second at most
                pad.send_data(bad)
                await pose_of(connection)
        refusal = refusals.get_nowait()
        assert refusal.label == "cmd_vel"
        assert refusal.code.startswith(("channel.", "safety."))
    assert math.dist(start, await pose_of(connection)) < 0.01


async def test_the_round_trip_is_measured(site: Site) -> None:
    connection = await site.connected()
    async with asyncio.timeout(30):
        while connection.round_trip_ms is None:
            await pose_of(connection)
    assert 0 < connection.round_trip_ms < 1000


async def test_three_operators_at_once_share_one_robot(site: Site) -> None:
    connections = await asyncio.gather(*(site.connected() for _ in range(3)))
    await asyncio.gather(*(connection.media("film").next_image() for connection in connections))
    await drive_until_it_moves(connections[0])
    places = await asyncio.gather(*(pose_of(connection) for connection in connections))
    assert max(math.dist(places[0], place) for place in places) < 0.5
    await connections[1].close()
    await pose_of(connections[2])
    await until_it_rests(connections[0])


async def test_the_robot_stops_when_the_commanding_operator_leaves(site: Site) -> None:
    watching, driving = await site.connected(), await site.connected()
    await drive_until_it_moves(driving)
    await driving.close()
    await until_it_rests(watching)


async def test_a_label_that_matches_nothing_names_the_nearest(site: Site) -> None:
    connection = await site.connected()
    with pytest.raises(Exception, match="battery"):
        connection.receivable("batery")


async def test_a_wrong_password_is_a_clear_error(site: Site) -> None:
    with pytest.raises(AuthError) as caught:
        await MosaicOperator.login(site.server.url, site.seed.email, "wrong")
    assert caught.value.code == "auth.failed"


async def test_a_server_restart_leaves_live_peers_untouched(site: Site, server: Any, robot: Any) -> None:
    connection = await site.connected()
    await pose_of(connection)
    await asyncio.to_thread(server.stop)
    await drive_until_it_moves(connection)
    await asyncio.to_thread(robot.wait_for, lambda row: row["state"] != "ready", "the robot misses its server")
    await asyncio.to_thread(server.start)
    await asyncio.to_thread(robot.wait_for, lambda row: row["state"] == "ready", "the robot is back", 45)
    await until_it_rests(connection)
    assert connection.peer_id in {peer["peer_id"] for peer in robot.snapshots[-1]["peers"]}
    await (await site.connected()).receivable("pose").next_message()


async def test_a_robot_restart_is_seen_by_operators_and_survived_by_the_server(site: Site, robot: Any) -> None:
    operator = await site.operator()
    connection = await operator.connect(site.seed.robot_id, timeout_s=20)
    await asyncio.to_thread(robot.kill)
    await operator.wait_status(site.seed.robot_id, RobotStatus.DISCONNECTED, 20)
    ended = await asyncio.wait_for(connection.wait_closed(), 10)
    assert isinstance(ended, ConnectionFailed)
    assert ended.code.startswith(("peer.", "ice."))
    robot.start()
    await operator.wait_status(site.seed.robot_id, RobotStatus.READY_TO_CONNECT, 30)
    await pose_of(await operator.connect(site.seed.robot_id, timeout_s=20))


async def test_the_robot_ends_within_two_seconds_while_it_is_being_driven(site: Site, robot: Any) -> None:
    connection = await site.connected()
    await drive_until_it_moves(connection)
    start_s = time.monotonic()
    code = await asyncio.to_thread(robot.stop)
    assert code == 0
    assert time.monotonic() - start_s < 3, "two seconds, and what a busy machine adds"
    assert (await asyncio.wait_for(connection.wait_closed(), 10)).code == "peer.shutdown"
    robot.start()
    await asyncio.to_thread(robot.wait_for, lambda row: row["state"] == "ready", "the robot is back", 30)
