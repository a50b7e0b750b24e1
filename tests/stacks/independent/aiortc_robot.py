"""A robot as the original C++ library (C2) behaves, on aiortc alone: its messages, its states, its gates."""

from __future__ import annotations

import asyncio
import json
import re
import time
import uuid
from collections.abc import Callable
from typing import Any

import numpy as np
from aiortc import RTCDataChannel, RTCPeerConnection, RTCSessionDescription, VideoStreamTrack
from aiortc.sdp import candidate_from_sdp
from av import VideoFrame
from independent.point_cloud import messages_of
from independent.wire import Wire

READY, CONNECTING, CONNECTED, DISCONNECTING, DISCONNECTED = 0, 1, 2, 3, 5
CANDIDATE_KEYS = {"candidate", "sdpMid", "sdpMLineIndex"}


class MovingSquare(VideoStreamTrack):
    """A white square that walks over a dark picture."""

    def __init__(self, width: int = 320, height: int = 240) -> None:
        super().__init__()
        self.shape = (height, width, 3)
        self.count = 0

    async def recv(self) -> VideoFrame:
        pts, time_base = await self.next_timestamp()
        image = np.full(self.shape, 40, np.uint8)
        left = self.count * 4 % (self.shape[1] - 60)
        image[90:150, left : left + 60] = 235
        self.count += 1
        frame = VideoFrame.from_ndarray(image, format="bgr24")
        frame.pts, frame.time_base = pts, time_base
        return frame


class C2Robot(Wire):
    """`pose` and `cloud` (senders), `cmd_vel` (Twist receiver), `link` (connection check) and cameras by label."""

    def __init__(self, url: str, robot_id: str, token: str = "", cameras: tuple[str, ...] = ()) -> None:
        super().__init__(url, "/ws/robot")
        self.robot_id, self.token, self.cameras = robot_id, token, cameras
        self.state = READY
        self.statuses: list[int] = []
        self.twists: list[tuple[float, float]] = []
        self.twist_texts: list[str | bytes] = []
        self.unmatched: list[str] = []
        self.protocols: dict[str, str] = {}
        """What each channel's creator wrote into DCEP's protocol: the original has nothing there."""
        self.channels: dict[str, RTCDataChannel] = {}
        self.is_authorized = asyncio.Event()
        self.connection_id = ""
        self.pc: RTCPeerConnection | None = None
        self._sending: list[asyncio.Task[None]] = []
        self._senders = {"pose": self._pose, "cloud-0": self._cloud}

    async def __aenter__(self) -> C2Robot:
        await self.open()
        await self._report()  # the cached state goes out before anybody asked for authorization
        async with asyncio.timeout(10):
            await self.is_authorized.wait()
        return self

    async def __aexit__(self, *_: object) -> None:
        await self._end_peer()
        self.state = DISCONNECTED
        await self._report()
        await self.shut()

    # -- signaling -------------------------------------------------------------------------------------------------

    async def heard(self, kind: str, data: Any) -> None:
        match kind:
            case "authorize.req":
                await self.say("authorize", {"robotId": self.robot_id} | ({"data": self.token} if self.token else {}))
            case "authorize.res":
                if type(data) is int and data == 100:
                    self.is_authorized.set()
            case "ping.ping":
                self.pings += 1
                await self.say("ping.pong", data)
            case "signaling.prepare_connection":
                self.connection_id = data["rtcConnectionId"]
            case "signaling.send_sdp_offer":
                await self._offered(data["sdpOffer"])
            case "signaling.exchange_ice_candidate":
                await self._candidate_arrived(data["iceCandidate"])
            case "signaling.close_peer_connection":
                if self.state == CONNECTED:
                    await self._close()

    async def _set(self, state: int) -> None:
        self.state = state
        await self._report()

    async def _report(self) -> None:
        self.statuses.append(self.state)
        await self.say("status.update", {"status": self.state})

    # -- the peer connection ---------------------------------------------------------------------------------------

    async def _offered(self, sdp: str) -> None:
        if self.state == CONNECTED:
            await self._close()
        if self.state != READY:
            return
        await self._set(CONNECTING)
        self.pc = pc = RTCPeerConnection()
        pc.on("datachannel", self._channel_arrived)
        pc.on("connectionstatechange", lambda: self._state_changed(pc))
        await pc.setRemoteDescription(RTCSessionDescription(sdp, "offer"))
        lines = [it for it in pc.getTransceivers() if it.kind == "video"]
        bound = list(zip(lines, self.cameras, strict=False))  # surplus cameras find no line and stay away
        for line, _ in bound:
            line.sender.replaceTrack(MovingSquare())
            line.direction = "sendonly"
        await pc.setLocalDescription(await pc.createAnswer())
        await self._answer(pc.localDescription.sdp, [(line.mid, label) for line, label in bound])

    async def _answer(self, sdp: str, labels: list[tuple[str, str]]) -> None:
        """The answer without candidates, one of which comes before it: libwebrtc gathers while it is being built."""
        head, *sections = re.split(r"(?=^m=)", sdp, flags=re.MULTILINE)
        found: list[dict[str, Any]] = []
        bare = [head]
        for index, section in enumerate(sections):
            mid = re.search(r"^a=mid:(.*?)\r?$", section, re.MULTILINE)[1]  # type: ignore[index]
            for line in re.findall(r"^a=(candidate:.*?)\r?$", section, re.MULTILINE):
                found.append({"candidate": line, "sdpMid": mid, "sdpMLineIndex": index})
            section = re.sub(r"^a=(candidate:.*|end-of-candidates)\r?\n", "", section, flags=re.MULTILINE)
            label = dict(labels).get(mid)
            bare.append(re.sub(r"^a=msid:.*?\r?$", f"a=msid:{label} {label}", section, flags=re.MULTILINE))
        first, *rest = found
        await self._trickle(first)
        await self.say("signaling.send_sdp_answer", {"rtcConnectionId": self.connection_id, "sdpAnswer": "".join(bare)})
        for candidate in rest:
            await self._trickle(candidate)

    async def _trickle(self, candidate: dict[str, Any]) -> None:
        await self.say(
            "signaling.exchange_ice_candidate", {"rtcConnectionId": self.connection_id, "iceCandidate": candidate}
        )

    async def _candidate_arrived(self, candidate: dict[str, Any]) -> None:
        if self.pc is None or any(candidate.get(key) is None for key in CANDIDATE_KEYS):
            return
        parsed = candidate_from_sdp(candidate["candidate"].removeprefix("candidate:"))
        parsed.sdpMid, parsed.sdpMLineIndex = candidate["sdpMid"], candidate["sdpMLineIndex"]
        await self.pc.addIceCandidate(parsed)

    async def _state_changed(self, pc: RTCPeerConnection) -> None:
        if pc is not self.pc:
            return
        if pc.connectionState == "connected" and self.state == CONNECTING:
            await self._set(CONNECTED)
        elif pc.connectionState in ("failed", "disconnected", "closed") and self.state == CONNECTED:
            await self._close()

    async def _close(self) -> None:
        await self._set(DISCONNECTING)
        await self._end_peer()
        await self._set(READY)

    async def _end_peer(self) -> None:
        pc, self.pc = self.pc, None
        for task in self._sending:
            task.cancel()
        self._sending.clear()
        self.channels.clear()
        if pc is not None:
            await pc.close()

    # -- connectors ------------------------------------------------------------------------------------------------

    def _channel_arrived(self, channel: RTCDataChannel) -> None:
        handlers: dict[str, Callable[[str | bytes], None]] = {
            "pose": lambda _: None,
            "cmd_vel": self._twist,
            "link-receiver": self._echo,
            "link-sender": lambda _: None,
            "cloud-0": lambda _: None,
        }
        self.protocols[channel.label] = channel.protocol
        if channel.label not in handlers or channel.label in self.channels:
            self.unmatched.append(channel.label)
            return
        self.channels[channel.label] = channel
        channel.on("message", handlers[channel.label])
        if channel.label in self._senders:
            self._sending.append(asyncio.create_task(self._senders[channel.label](channel)))

    async def _pose(self, channel: RTCDataChannel) -> None:
        while channel.readyState == "open":
            position = {"x": time.monotonic() % 10, "y": 1.5, "z": 0.0}
            orientation = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
            pose = {"position": position, "orientation": orientation, "timestamp": time.time_ns() // 1000}
            channel.send(json.dumps(pose, indent="\t"))  # over many lines, as the original's writer does
            await asyncio.sleep(0.1)

    async def _cloud(self, channel: RTCDataChannel) -> None:
        turn = np.linspace(0, 2 * np.pi, 2500, dtype=np.float32)
        ring = np.stack([3 * np.cos(turn), 3 * np.sin(turn), np.sin(5 * turn), turn], axis=1)
        while channel.readyState == "open":
            for message in messages_of(ring, str(uuid.uuid4()), 1000):
                channel.send(message)
            await asyncio.sleep(0.3)

    def _twist(self, message: str | bytes) -> None:
        self.twist_texts.append(message)
        twist = json.loads(message)
        self.twists.append((twist.get("linear", {}).get("x", 0.0), twist.get("angular", {}).get("z", 0.0)))

    def _echo(self, message: str | bytes) -> None:
        if "link-sender" in self.channels:
            self.channels["link-sender"].send(message)


class C1Robot(Wire):
    """The library before it could connect: no pongs, other spellings, and never an answer to an offer."""

    def __init__(self, url: str, robot_id: str, token: str) -> None:
        super().__init__(url, "/ws/robot")
        self.robot_id, self.token = robot_id, token
        self.is_authorized = asyncio.Event()
        self.connection_id = ""

    async def __aenter__(self) -> C1Robot:
        await self.open()
        await self.say("status.update", {"status": READY})
        async with asyncio.timeout(10):
            await self.is_authorized.wait()
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.shut()

    async def heard(self, kind: str, data: Any) -> None:
        if kind == "authorize.req":
            await self.say("authorize", {"robotId": self.robot_id, "data": self.token})
        elif kind == "authorize.res" and type(data) is int and data == 100:
            self.is_authorized.set()
        elif kind == "signaling.send_sdp_offer":
            self.connection_id = data["rtcConnectionId"]
            await self.say("status.update", {"status": CONNECTING})
