"""A dashboard page as the original one (S2) behaves, on aiortc alone: REST, its socket, its offer, no queues."""

from __future__ import annotations

import asyncio
import json
import re
import time
from typing import Any

from aiortc import (
    MediaStreamTrack,
    RTCBundlePolicy,
    RTCConfiguration,
    RTCDataChannel,
    RTCPeerConnection,
    RTCSessionDescription,
)
from aiortc.sdp import candidate_from_sdp
from independent.wire import Rest, Wire, until

STORES: dict[str, str] = {
    "ConnectionCheckReceiverStore": "data",
    "ConnectionCheckSenderStore": "data",
    "H1DirectionSenderStore": "data",
    "JsonReceivableStore": "data",
    "MediaStreamStore": "video",
    "PointCloudStore": "parallel",
    "ProgressivePointCloudStore": "parallel",
    "Ros2WasdToTwistStore": "data",
    "StringReceivableStore": "data",
    "ThumbstickToTwistStore": "data",
}
"""The original page's registry: a connector of any other type is rejected."""


class Page(Wire):
    """One signed-in tab. `async with Page(url, email, password) as page`."""

    def __init__(self, url: str, email: str, password: str) -> None:
        super().__init__(url, "/ws/user")
        self.rest = Rest(url)
        self._account = (email, password)
        self._is_authorized = asyncio.Event()
        self.calls: dict[str, Call] = {}

    async def __aenter__(self) -> Page:
        await self.rest.log_in(*self._account)
        await self.open()
        async with asyncio.timeout(10):
            await self._is_authorized.wait()
        return self

    async def __aexit__(self, *_: object) -> None:
        await asyncio.gather(*(call.pc.close() for call in self.calls.values()))
        await self.shut()
        await self.rest.close()

    async def heard(self, kind: str, data: Any) -> None:
        match kind:
            case "authorize.req":
                await self.say("authorize", {"accessToken": self.rest.token})
            case "authorize.res":
                assert data == 100, f"authorize.res {data}"
                self._is_authorized.set()
            case "ping.ping":
                self.pings += 1
                await self.say("ping.pong", {"pingId": data["pingId"]})
            case "signaling.send_sdp_answer":
                await self.calls[data["rtcConnectionId"]].answered(data["sdpAnswer"])
            case "signaling.exchange_ice_candidate":
                await self.calls[data["rtcConnectionId"]].candidate_arrived(data["iceCandidate"])

    def statuses(self, robot_id: str) -> list[int]:
        return [it["status"] for it in self.said("status.update") if it["robotId"] == robot_id]

    async def wait_ready(self, robot_id: str) -> None:
        """The original offers its button once the status is 0."""
        await self.say("status.subscribe", {"robotIds": [robot_id]})
        await until(lambda: self.statuses(robot_id)[-1:] == [0], "the robot is ready to connect")

    async def call(self, robot_id: str, labels: tuple[str, ...] = (), videos: int = 0) -> Call:
        """Connect as the page does and wait until every channel is open."""
        await self.rest.http.get("/api/v1/webrtc/ice-servers")
        made = await self.rest("POST", "/api/v1/webrtc/connection", robotIds=[robot_id])
        (session,) = made["sessions"]
        assert session["robotId"] == robot_id
        call = Call(self, session["rtcSessionId"], labels, videos)
        self.calls[call.id] = call
        await call.offer()
        await until(lambda: call.pc.connectionState == "connected", "the call is connected")
        await until(lambda: all(it.readyState == "open" for it in call.channels.values()), "all channels are open")
        return call

    async def call_as_configured(self, robot_id: str) -> Call:
        """What a page of widgets over all of `connectorConfig` asks for."""
        config = json.loads((await self.rest.robot(robot_id))["connectorConfig"])
        labels: list[str] = []
        videos = 0
        for connector in config["connectors"]:
            kind = STORES[connector["connectorType"]]
            count = (connector.get("params") or {}).get("parallelNum")
            if kind == "video":
                videos += 1
            elif count:
                labels += [f"{connector['connectorId']}-{index}" for index in range(count)]
            else:
                labels.append(connector["connectorId"])
        return await self.call(robot_id, tuple(labels), videos)


class Call:
    """One peer connection of the page."""

    def __init__(self, page: Page, call_id: str, labels: tuple[str, ...], videos: int) -> None:
        self.page, self.id = page, call_id
        self.began_s = time.monotonic()
        self.pc = RTCPeerConnection(RTCConfiguration(iceServers=[], bundlePolicy=RTCBundlePolicy.MAX_BUNDLE))
        self.received: dict[str, list[str | bytes]] = {label: [] for label in labels}
        self.tracks: list[MediaStreamTrack] = []
        self.rejected_candidates = 0
        self.answer_sdp = ""
        for _ in range(videos):  # lines before channels: aiortc as the offerer mixes up bundled transports otherwise
            self.pc.addTransceiver("video", direction="sendrecv")
        self.channels: dict[str, RTCDataChannel] = {label: self._channel(label) for label in labels}
        self.pc.on("track", self.tracks.append)

    def _channel(self, label: str) -> RTCDataChannel:
        channel = self.pc.createDataChannel(label)
        channel.on("message", self.received[label].append)
        return channel

    async def offer(self) -> None:
        """The offer of a browser that trickles: candidates follow one by one, with three keys."""
        await self.pc.setLocalDescription(await self.pc.createOffer())
        sdp = self.pc.localDescription.sdp
        found = list(dict.fromkeys(re.findall(r"^a=(candidate:.*?)\r?$", sdp, re.MULTILINE)))
        mid = re.search(r"^a=mid:(.*?)\r?$", sdp, re.MULTILINE)[1]  # type: ignore[index]
        bare = re.sub(r"^a=(candidate:.*|end-of-candidates)\r?\n", "", sdp, flags=re.MULTILINE)
        await self.page.say("signaling.send_sdp_offer", {"rtcConnectionId": self.id, "sdpOffer": bare})
        for line in found:
            candidate = {"candidate": line, "sdpMid": mid, "sdpMLineIndex": 0}
            await self.page.say(
                "signaling.exchange_ice_candidate", {"rtcConnectionId": self.id, "iceCandidate": candidate}
            )

    async def answered(self, sdp: str) -> None:
        self.answer_sdp = sdp
        await self.pc.setRemoteDescription(RTCSessionDescription(sdp, "answer"))

    async def candidate_arrived(self, candidate: dict[str, Any]) -> None:
        assert set(candidate) == {"candidate", "sdpMid", "sdpMLineIndex"}
        if not self.answer_sdp:  # a browser rejects it, and the original page keeps no queue
            self.rejected_candidates += 1
            return
        parsed = candidate_from_sdp(candidate["candidate"].removeprefix("candidate:"))
        parsed.sdpMid = candidate["sdpMid"]
        await self.pc.addIceCandidate(parsed)

    async def hang_up(self) -> None:
        await self.page.say("signaling.close_peer_connection", {"rtcConnectionId": self.id})
        await self.pc.close()

    @property
    def streams(self) -> list[str]:
        """The stream of each line on which the robot sends, as `a=msid:` tells a browser."""
        return re.findall(r"^a=msid:(\S+)", self.answer_sdp, re.MULTILINE)

    def objects(self, label: str) -> list[Any]:
        """What arrived on a JSON channel; every message must be a bare text."""
        assert all(isinstance(message, str) for message in self.received[label]), f"not text on {label}"
        return [json.loads(message) for message in self.received[label]]

    async def check(self, label: str = "link") -> float:
        """One round of the connection check; the one-way estimate in ms, as the page shows it."""
        seen = len(self.received[f"{label}-sender"])
        stamp = json.dumps({"messageCreated": time.time() * 1e3})
        self.channels[f"{label}-receiver"].send(stamp)
        await until(lambda: len(self.received[f"{label}-sender"]) > seen, "the echo")
        assert self.received[f"{label}-sender"][-1] == stamp
        return (time.time() * 1e3 - float(json.loads(stamp)["messageCreated"])) / 2
