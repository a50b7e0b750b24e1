"""Our server and our Python operator at a robot as the original library behaves, played by aiortc alone.

It takes one offer and never another, gives its cameras to the offered lines in the order of its file, matches channels
by their label and leaves others unread, and sends every camera that has a line.
"""

from __future__ import annotations

import asyncio
import functools
import json
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from typing import Any

import httpx
import numpy as np
import pytest
from aiortc import RTCDataChannel, RTCPeerConnection, RTCSessionDescription, VideoStreamTrack
from aiortc.sdp import candidate_from_sdp
from av import VideoFrame
from websockets.asyncio.client import connect

from mosaic_core.cli.operator.control_actions import stop_robot
from mosaic_core.operator import MosaicOperator, RobotConnector
from mosaic_core.words.errors import ConnectionFailed
from mosaic_core.words.signaling import RobotStatus

pytestmark = [pytest.mark.webrtc, pytest.mark.timeout(120)]
WAIT_S = 20.0
GREY = {"front": 60, "rear": 190}
"""The cameras in the order of the robot's file, told apart by how bright they are."""
CONFIG = {
    "connectors": [
        {"connectorId": "odom", "connectorType": "JsonReceivableStore", "params": {}},
        {"connectorId": "front", "connectorType": "MediaStreamStore", "params": {}},
        {"connectorId": "rear", "connectorType": "MediaStreamStore", "params": {}},
        {"connectorId": "cmd_vel", "connectorType": "Ros2WasdToTwistStore", "params": {}},
        {"connectorId": "link-receiver", "connectorType": "ConnectionCheckSenderStore", "params": {}},
        {"connectorId": "link-sender", "connectorType": "ConnectionCheckReceiverStore", "params": {}},
    ]
}


def scenario(test: Callable[..., Coroutine[Any, Any, None]]) -> Callable[..., None]:
    """A test that is a coroutine."""

    @functools.wraps(test)
    def run(**fixtures: Any) -> None:
        asyncio.run(test(**fixtures))

    return run


class GreyTrack(VideoStreamTrack):
    def __init__(self, label: str) -> None:
        super().__init__()
        self._id = label
        self._grey = GREY[label]

    async def recv(self) -> VideoFrame:
        frame = VideoFrame.from_ndarray(np.full((120, 160, 3), self._grey, np.uint8), format="bgr24")
        frame.pts, frame.time_base = await self.next_timestamp()
        return frame


class OriginalRobot:
    """One socket, one peer connection at a time."""

    def __init__(self, socket: Any) -> None:
        self._socket = socket
        self.offers = 0
        self.commands: list[Any] = []
        self.channels: dict[str, RTCDataChannel] = {}
        self._pc: RTCPeerConnection | None = None
        self._peer_id = ""
        self._tasks: set[asyncio.Task[None]] = set()

    async def serve(self, robot_id: str, token: str) -> None:
        async for text in self._socket:
            message = json.loads(text)
            kind, data = message["type"], message["data"]
            match kind:
                case "authorize.req":
                    await self._say("authorize", {"robotId": robot_id, "data": token})
                case "authorize.res":
                    assert data == 100
                    await self._say("status.update", {"status": 0})
                case "ping.ping":
                    await self._say("ping.pong", data)
                case "signaling.send_sdp_offer":
                    await self._offered(data["rtcConnectionId"], data["sdpOffer"])
                case "signaling.exchange_ice_candidate":
                    await self._candidate(data["iceCandidate"])
                case "signaling.close_peer_connection":
                    await self.hang_up()

    async def hang_up(self) -> None:
        pc, self._pc = self._pc, None
        if pc is not None:
            await self._say("status.update", {"status": 3})
            await pc.close()
            await self._say("status.update", {"status": 0})

    async def _say(self, kind: str, data: Any) -> None:
        await self._socket.send(json.dumps({"type": kind, "data": data}))

    async def _offered(self, peer_id: str, sdp: str) -> None:
        await self.hang_up()
        self.offers += 1
        self._peer_id, self._pc = peer_id, RTCPeerConnection()
        self.channels = {}
        pc = self._pc
        await self._say("status.update", {"status": 1})
        pc.on("datachannel", self._channel_arrived)
        pc.on("connectionstatechange", lambda: self._run(self._state_changed(pc)))
        await pc.setRemoteDescription(RTCSessionDescription(sdp, "offer"))
        lines = [line for line in pc.getTransceivers() if line.kind == "video"]
        for line, label in zip(lines, GREY, strict=False):
            line.sender.replaceTrack(GreyTrack(label))
            line.sender._stream_id = label
            line.direction = "sendonly"
        await pc.setLocalDescription(await pc.createAnswer())
        answer = {"rtcConnectionId": peer_id, "sdpAnswer": pc.localDescription.sdp}
        await self._say("signaling.send_sdp_answer", answer)

    async def _state_changed(self, pc: RTCPeerConnection) -> None:
        if pc is self._pc and pc.connectionState == "connected":
            await self._say("status.update", {"status": 2})

    async def _candidate(self, candidate: dict[str, Any]) -> None:
        if self._pc is not None:
            parsed = candidate_from_sdp(candidate["candidate"].removeprefix("candidate:"))
            parsed.sdpMid = candidate["sdpMid"]
            await self._pc.addIceCandidate(parsed)

    def _channel_arrived(self, channel: RTCDataChannel) -> None:
        self.channels[channel.label] = channel
        if channel.label == "cmd_vel":
            channel.on("message", lambda text: self.commands.append(json.loads(text)))
        elif channel.label == "link-receiver":
            channel.on("message", lambda text: self.channels["link-sender"].send(text))
        elif channel.label == "odom":
            self._run(self._tell(channel))

    async def _tell(self, channel: RTCDataChannel) -> None:
        while channel.readyState == "open":
            channel.send('{\n\t"x" : 1.5\n}')
            await asyncio.sleep(0.05)

    def _run(self, work: Any) -> None:
        task = asyncio.ensure_future(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)


@pytest.fixture
def site(server: Any, seed: Any) -> Any:
    """``async with site(config) as (operator, robot)``: an operator, and an original robot described like that."""

    @asynccontextmanager
    async def opened(config: dict[str, Any] | None) -> AsyncIterator[tuple[MosaicOperator, OriginalRobot]]:
        operator = await MosaicOperator.login(server.url, seed.email, seed.password)
        async with httpx.AsyncClient(base_url=server.url, trust_env=False) as http:
            change = {"name": "Test robot", "connectorConfig": json.dumps(config or {})}
            headers = {"Authorization": f"Bearer {operator.access_token}"}
            done = await http.put(f"/api/v1/robots/{seed.robot_id}", json=change, headers=headers)
            assert done.is_success, done.text
        async with connect(f"ws://127.0.0.1:{server.port}/ws/robot") as socket, operator:
            robot = OriginalRobot(socket)
            serving = asyncio.create_task(robot.serve(seed.robot_id, seed.robot_token))
            await operator.wait_status(seed.robot_id, RobotStatus.READY_TO_CONNECT, WAIT_S)
            try:
                yield operator, robot
            finally:
                await operator.close()
                await robot.hang_up()
                serving.cancel()

    return opened


def brightness(image: Any) -> float:
    return float(np.mean(image))


@scenario
async def test_a_described_robot_is_used_by_its_labels_alone(site: Any, seed: Any) -> None:
    async with site(CONFIG) as (operator, robot):
        connection = await operator.connect(seed.robot_id, timeout_s=WAIT_S)
        assert connection.is_original
        assert (await connection.receivable("odom").next_message(WAIT_S)).json() == {"x": 1.5}
        for label, grey in GREY.items():
            assert abs(brightness(await connection.media(label).next_image(WAIT_S)) - grey) < 12
        check = connection.connection_check("link")
        await check.next_message(WAIT_S)
        assert check.round_trip_ms is not None
        with pytest.raises(ConnectionFailed) as none:
            await connection.control.stop()
        assert none.value.code == "safety.no_stop"
        report = await connection.send_zeros()
        assert report.arrived == ("cmd_vel",)
        assert robot.commands[-1]["linear"] == {"x": 0, "y": 0, "z": 0}


@scenario
async def test_a_robot_that_nobody_described_is_used_by_label_and_data_type(site: Any, seed: Any) -> None:
    async with site(None) as (operator, _):
        front = RobotConnector(seed.robot_id, "front", "media")
        connection = await operator.connect(seed.robot_id, connectors=[front], timeout_s=WAIT_S)
        assert connection.catalogue is None
        assert (await connection.receivable("odom", "json-r2u").next_message(WAIT_S)).json() == {"x": 1.5}
        assert abs(brightness(await connection.media("front").next_image(WAIT_S)) - GREY["front"]) < 12


@scenario
async def test_the_picture_of_one_camera_is_never_shown_as_that_of_another(site: Any, seed: Any) -> None:
    """Of the second camera alone there is no line: the robot gives the first one away first."""
    async with site(None) as (operator, _):
        rear = RobotConnector(seed.robot_id, "rear", "media")
        await operator.connect(seed.robot_id, connectors=[rear], timeout_s=WAIT_S)
        with pytest.raises(ConnectionFailed, match="it sends 'front'"):
            await operator.stores.get_or_create_store(rear).wait_open(WAIT_S)


@scenario
async def test_a_camera_asked_for_later_says_why_not_or_gets_another_connection(site: Any, seed: Any) -> None:
    front = RobotConnector(seed.robot_id, "front", "media")
    async with site(None) as (operator, robot):
        await operator.connect(seed.robot_id, timeout_s=WAIT_S)
        with pytest.raises(ConnectionFailed) as late:
            await operator.stores.get_or_create_store(front).wait_open(WAIT_S)
        assert late.value.code == "media.no_line"
        operator.stores.release_store(front)

    async with site(None) as (operator, robot):
        connection = await operator.connect(seed.robot_id, may_break=True, timeout_s=WAIT_S)
        odom = connection.receivable("odom", "json-r2u")
        await odom.next_message(WAIT_S)
        camera = connection.media("front")
        assert abs(brightness(await camera.next_image(WAIT_S)) - GREY["front"]) < 12
        assert robot.offers == 2
        await odom.next_message(WAIT_S)


@scenario
async def test_stop_at_a_terminal_sends_the_zeros_that_it_tells_of(
    site: Any, seed: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    async with site(CONFIG) as (operator, robot):
        assert await stop_robot(operator, seed.robot_id, "", "", None, as_json=False) == 1
        assert "Zeros arrived at 'cmd_vel'" in capsys.readouterr().out
        assert robot.commands == [{"linear": {"x": 0, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": 0}}]
