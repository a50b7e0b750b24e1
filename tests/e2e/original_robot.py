"""An original robot (C2) for a browser to meet: signaling and peer connection from the documents, on aiortc alone."""

from __future__ import annotations

import asyncio
import json
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from aiortc import RTCDataChannel, RTCPeerConnection, RTCSessionDescription, VideoStreamTrack
from aiortc.sdp import candidate_from_sdp
from av import VideoFrame
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

READY, CONNECTING, CONNECTED, DISCONNECTING = 0, 1, 2, 3
PERIOD_S = 0.1


class Stripes(VideoStreamTrack):
    """Stripes that wander."""

    def __init__(self) -> None:
        super().__init__()
        self.count = 0

    async def recv(self) -> VideoFrame:
        pts, time_base = await self.next_timestamp()
        self.count += 1
        columns = (np.arange(320) + 3 * self.count) // 32 % 2 * 160 + 40
        image = np.repeat(np.broadcast_to(columns[None, :, None], (240, 320, 1)), 3, axis=2).astype(np.uint8)
        frame = VideoFrame.from_ndarray(np.ascontiguousarray(image), format="bgr24")
        frame.pts, frame.time_base = pts, time_base
        return frame


@dataclass
class OriginalRobot:
    """Runs on a thread of its own. `senders`: label → what it says ten times a second; `receivers`: labels it hears."""

    url: str
    robot_id: str
    token: str
    cameras: tuple[str, ...] = ()
    senders: dict[str, Callable[[], str | bytes]] = field(default_factory=dict)
    receivers: tuple[str, ...] = ()
    heard: list[tuple[str, Any]] = field(default_factory=list)
    """What arrived for the receivers: label and JSON."""
    statuses: list[int] = field(default_factory=list)
    offers: list[str] = field(default_factory=list)
    state: int = READY
    is_ready: threading.Event = field(default_factory=threading.Event)
    _open: dict[str, RTCDataChannel] = field(default_factory=dict)
    _tasks: set[asyncio.Task[None]] = field(default_factory=set)
    _peer: RTCPeerConnection | None = None
    _connection_id: str = ""
    _socket: ClientConnection | None = None
    _loop: asyncio.AbstractEventLoop = field(default_factory=asyncio.new_event_loop)
    _thread: threading.Thread | None = None

    def start(self) -> None:
        self._thread = threading.Thread(target=self._run, name="original-robot", daemon=True)
        self._thread.start()
        assert self.is_ready.wait(20), "the original robot was not let in"

    def stop(self) -> None:
        assert self._socket is not None
        assert self._thread is not None
        asyncio.run_coroutine_threadsafe(self._socket.close(), self._loop)
        self._thread.join(10)

    def commands(self, label: str) -> list[Any]:
        return [data for one, data in self.heard if one == label]

    def _run(self) -> None:
        self._loop.run_until_complete(self._serve())
        self._loop.close()

    async def _serve(self) -> None:
        async with connect(self.url.replace("http", "ws", 1) + "/ws/robot") as self._socket:
            with suppress(ConnectionClosed):
                async for text in self._socket:
                    frame = json.loads(text)
                    await self._take(frame["type"], frame["data"])
        await self._end_peer()

    async def _say(self, kind: str, data: dict[str, Any]) -> None:
        assert self._socket is not None
        with suppress(ConnectionClosed):
            await self._socket.send(json.dumps({"type": kind, "data": data}))

    async def _enter(self, state: int) -> None:
        self.state = state
        self.statuses.append(state)
        await self._say("status.update", {"status": state})

    async def _take(self, kind: str, data: Any) -> None:
        match kind:
            case "authorize.req":
                await self._say("authorize", {"robotId": self.robot_id, "data": self.token})
            case "authorize.res" if data == 100:
                await self._enter(READY)
                self.is_ready.set()
            case "ping.ping":
                await self._say("ping.pong", data)
            case "signaling.prepare_connection":
                self._connection_id = data["rtcConnectionId"]
            case "signaling.send_sdp_offer":
                self.offers.append(data["sdpOffer"])
                await self._answer(data["sdpOffer"])
            case "signaling.exchange_ice_candidate" if self._peer is not None:
                said = data["iceCandidate"]
                candidate = candidate_from_sdp(said["candidate"].removeprefix("candidate:"))
                candidate.sdpMid, candidate.sdpMLineIndex = said["sdpMid"], said["sdpMLineIndex"]
                await self._peer.addIceCandidate(candidate)
            case "signaling.close_peer_connection" if self.state == CONNECTED:
                await self._leave()

    async def _answer(self, sdp: str) -> None:
        if self.state == CONNECTED:
            await self._leave()
        await self._enter(CONNECTING)
        self._peer = peer = RTCPeerConnection()
        peer.on("datachannel", self._channel_opened)
        peer.on("connectionstatechange", lambda: self._changed(peer))
        await peer.setRemoteDescription(RTCSessionDescription(sdp, "offer"))
        lines = [line for line in peer.getTransceivers() if line.kind == "video"]
        for line, label in zip(lines, self.cameras, strict=False):  # a camera too many finds no line
            line.sender.replaceTrack(Stripes())
            line.sender._stream_id = label
            line.direction = "sendonly"
        await peer.setLocalDescription(await peer.createAnswer())
        said = {"rtcConnectionId": self._connection_id, "sdpAnswer": peer.localDescription.sdp}
        await self._say("signaling.send_sdp_answer", said)

    async def _changed(self, peer: RTCPeerConnection) -> None:
        if peer is not self._peer:
            return
        if peer.connectionState == "connected":
            await self._enter(CONNECTED)
        elif peer.connectionState in ("failed", "closed"):
            await self._leave()

    async def _leave(self) -> None:
        await self._enter(DISCONNECTING)
        await self._end_peer()
        await self._enter(READY)

    async def _end_peer(self) -> None:
        peer, self._peer = self._peer, None
        self._open.clear()
        for task in self._tasks:
            task.cancel()
        if peer is not None:
            await peer.close()

    def _channel_opened(self, channel: RTCDataChannel) -> None:
        label = channel.label
        if label in self._open:  # the original does not heed a label that is open already
            return
        self._open[label] = channel
        channel.on("close", lambda: self._open.pop(label, None))
        if label in self.senders:
            task = asyncio.create_task(self._send(channel, self.senders[label]))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)
        elif label in self.receivers:
            channel.on("message", lambda text: self.heard.append((label, json.loads(text))))
        elif label == "L-receiver":
            channel.on("message", self._echo)

    def _echo(self, text: str) -> None:
        if "L-sender" in self._open:
            self._open["L-sender"].send(text)

    async def _send(self, channel: RTCDataChannel, message: Callable[[], str | bytes]) -> None:
        while channel.readyState == "open":
            channel.send(message())
            await asyncio.sleep(PERIOD_S)
