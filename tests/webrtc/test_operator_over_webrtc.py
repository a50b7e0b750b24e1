"""The headless operator over real peer connections, to a scripted robot; server in memory."""

from __future__ import annotations

import asyncio
import contextlib
import json
import time
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from typing import Any

import httpx
import numpy as np
import pytest

from mosaic_core.adapters.peers.aiortc_answerer import AiortcAnswerer
from mosaic_core.adapters.video.shared_video import SharedVideo
from mosaic_core.contract.media import Captured, EncodingParams
from mosaic_core.machines.delivery.framing import Frame, FrameReader, PayloadKind, encode_frame
from mosaic_core.operator import MosaicOperator
from mosaic_core.runtime.observation.counters import ConnectorCounters
from mosaic_core.runtime.transport.media_transport import PictureFeed
from mosaic_core.runtime.transport.peer_congestion import PeerCongestion
from mosaic_core.words import control, signaling
from mosaic_core.words.catalogue import Catalogue, CatalogueEntry, ChannelEntry
from mosaic_core.words.data_type import Delivery, Kind, MosaicDataType
from mosaic_core.words.signaling import IceCandidate

pytestmark = pytest.mark.webrtc
WAIT_S = 30.0
ROBOT_ID = "7d1c2f6e-0b52-4c1e-9a53-2f6f1f0c9b11"
PEER_ID = "22222222-0b52-4c1e-9a53-2f6f1f0c9b11"
BGR = (30, 160, 220)


def entry(label: str, data_type: MosaicDataType, delivery: Delivery = Delivery.RELIABLE) -> CatalogueEntry:
    is_media = data_type is MosaicDataType.MEDIA
    return CatalogueEntry(
        label=label,
        type=label,
        kind=Kind.VIDEO if is_media else Kind.DATA,
        data_type=data_type,
        direction=data_type.direction,
        delivery=delivery,
        channels=() if is_media else (ChannelEntry(label=label, data_type=data_type),),
    )


CATALOGUE = Catalogue.of([
    entry("cloud", MosaicDataType.BYTE_R2U),
    entry("cmd_vel", MosaicDataType.JSON_U2R, Delivery.LATEST),
    entry("front", MosaicDataType.MEDIA),
])  # fmt: skip


class OneColour:
    """Silent until watched, then ten pictures a second of one colour."""

    def __init__(self) -> None:
        self.is_watched = asyncio.Event()
        self.stream = SharedVideo("front", EncodingParams(), ConnectorCounters())
        self._filming: asyncio.Task[None] | None = None

    def watch(self) -> None:
        self.is_watched.set()
        self.stream.watch(PEER_ID, True)
        self._filming = asyncio.create_task(self._film())

    async def _film(self) -> None:
        while True:
            self.stream.offer(Captured(np.full((120, 160, 3), BGR, np.uint8), time.monotonic()))
            await asyncio.sleep(0.1)

    def close(self) -> None:
        if self._filming is not None:
            self._filming.cancel()
        self.stream.close()


class ScriptedRobot:
    """The robot's side: answers, greets, echoes what it needs to; and the server between, as function calls."""

    def __init__(self) -> None:
        self.to_operator: asyncio.Queue[str | None] = asyncio.Queue()
        self.camera = OneColour()
        self.commands: asyncio.Queue[Any] = asyncio.Queue()
        self.states: list[str] = []
        self.channels: dict[str, Any] = {}
        self.stops: list[tuple[str, str]] = []
        self.seen: asyncio.Queue[control.MediaSeen] = asyncio.Queue()
        self.is_answering = True
        self.media = self
        self.congestion = PeerCongestion()
        self.answerer = AiortcAnswerer(self, ())

    # the answerer's listener
    def candidate_found(self, candidate: IceCandidate) -> None:
        self.push(signaling.ExchangeIceCandidate(rtc_connection_id=PEER_ID, ice_candidate=candidate))

    def bound_exceeded(self, why: str) -> None: ...

    is_local = True

    def state_changed(self, state: str) -> None:
        self.states.append(state)

    def track_bound(self, label: str) -> PictureFeed:
        return self.camera.stream.bind(PEER_ID, self.states.append)

    def tracks_unbound(self, labels: Sequence[str]) -> None: ...
    def track_refused(self, label: str, cause: str) -> None: ...

    def origin_known(self, label: str, ssrc: int, rtp_origin: int) -> None:
        self.say(control.MediaOrigin(label=label, ssrc=ssrc, rtp_origin=rtp_origin, boot_id="b"))

    def channel_opened(self, channel: Any) -> None:
        self.channels[channel.label] = channel
        reader = FrameReader()

        def arrived(data: bytes | str) -> None:
            assert isinstance(data, bytes)
            frame = reader.read(data, time.monotonic())
            if frame is not None:
                self.heard(channel, frame)

        channel.on_message = arrived
        if channel.label == control.CONTROL_LABEL:
            self.say(control.Hello(software="scripted", boot_id="b", extensions=control.CONTROL_EXTENSIONS))

    def heard(self, channel: Any, frame: Frame) -> None:
        if channel.label == control.STOP_LABEL:
            stop = control.parse_control(frame.payload.decode())
            assert isinstance(stop, control.Stop)
            self.stops.append((channel.label, stop.reason))
            now_us = time.monotonic_ns() // 1000
            self.say(control.StopAck(id=stop.id, received_us=now_us, safe_us=now_us), channel.label)
            return
        if channel.label != control.CONTROL_LABEL:
            self.commands.put_nowait((channel.is_reliable, json.loads(frame.payload)))
            return
        message = control.parse_control(frame.payload.decode())
        if isinstance(message, control.Hello):
            self.say(control.CatalogueFull(catalogue=CATALOGUE))
        elif isinstance(message, control.Ping) and self.is_answering:
            now_us = time.monotonic_ns() // 1000
            self.say(control.Pong(t0=message.t0, t1=now_us, t2=now_us))
        elif isinstance(message, control.MediaSeen):
            self.seen.put_nowait(message)
        elif isinstance(message, control.MediaWatch) and message.on:
            self.camera.watch()

    def say(self, message: control.ControlMessage, label: str = control.CONTROL_LABEL) -> None:
        for part in encode_frame(Frame(PayloadKind.JSON, message.to_text().encode())):
            self.channels[label].send(part)

    # the server
    def push(self, message: signaling.SignalingMessage) -> None:
        self.to_operator.put_nowait(message.to_text())

    async def connect(self, url: str) -> ScriptedRobot:
        self.push(signaling.AuthorizeRequest(extensions=signaling.EXTENSIONS))
        return self

    close_code: int | None = None

    async def __aiter__(self) -> Any:
        while (text := await self.to_operator.get()) is not None:
            yield text

    async def send(self, text: str) -> None:
        match signaling.parse_signaling(text):
            case signaling.Authorize(extensions=extensions):
                self.push(signaling.AuthorizeResult(code=100))
                self.push(signaling.SessionWelcome(server="scripted", extensions=extensions or {}))
            case signaling.SdpOffer(sdp_offer=sdp, tracks=tracks):
                answer = await self.answerer.answer(sdp, ["front"], tracks)
                self.push(signaling.SdpAnswer(rtc_connection_id=PEER_ID, sdp_answer=answer))
            case signaling.ExchangeIceCandidate(ice_candidate=candidate):
                await self.answerer.add_candidate(candidate)
            case _:
                pass

    async def close(self, code: int = 1000, reason: str = "") -> None:
        self.to_operator.put_nowait(None)


def respond(request: httpx.Request) -> httpx.Response:
    if request.url.path.endswith("ice-servers"):
        return httpx.Response(200, json=[])
    if request.url.path.endswith("catalogue"):
        return httpx.Response(200, json={"resultCode": 100, "resultData": CATALOGUE.short().wire()})
    session = {"robotId": ROBOT_ID, "rtcSessionId": PEER_ID, "sessionId": "s"}
    return httpx.Response(200, json={"resultCode": 100, "resultData": {"sessions": [session]}})


@asynccontextmanager
async def run() -> AsyncIterator[Any]:
    robot = ScriptedRobot()
    operator = MosaicOperator(
        "http://127.0.0.1:9001", "jwt", open_socket=robot.connect, http=httpx.MockTransport(respond)
    )
    try:
        async with operator, asyncio.timeout(60):
            yield robot, operator
    finally:
        await robot.answerer.close()
        robot.camera.close()


async def test_pictures_data_and_commands_flow() -> None:
    async with run() as (robot, operator):
        started_s = time.monotonic()
        connection = await operator.connect(ROBOT_ID, timeout_s=WAIT_S)
        assert time.monotonic() - started_s < 5
        assert connection.catalogue == CATALOGUE
        assert not robot.camera.is_watched.is_set()

        image = await connection.media("front").next_image(WAIT_S)
        assert image.shape == (120, 160, 3)
        assert np.abs(image.astype(int) - np.array(BGR)).mean() < 8

        cloud = connection.receivable("cloud")
        await cloud.wait_open(WAIT_S)
        large = bytes(range(256)) * 2000  # 512 kB: travels in chunks
        waiting = asyncio.create_task(cloud.next_message(WAIT_S))
        await asyncio.sleep(0)
        for part in encode_frame(Frame(PayloadKind.BYTES, large, seq=1, stamp_us=time.monotonic_ns() // 1000)):
            robot.channels["cloud"].send(part)
        received = await waiting
        assert received.data == large
        assert received.info.age_s is not None
        assert received.info.age_s < 5

        commands = connection.sendable("cmd_vel")
        await commands.wait_open(WAIT_S)
        assert commands.send_json({"linear": {"x": 0.5}})
        async with asyncio.timeout(WAIT_S):
            assert await robot.commands.get() == (False, {"linear": {"x": 0.5}})
        assert connection.round_trip_ms is not None
        assert abs(connection.clock_offset_us or 0) < 100_000  # the same machine, the same clock


async def test_a_robot_that_hangs_is_lost_in_two_seconds_though_ice_still_lives() -> None:
    async with run() as (robot, operator):
        connection = await operator.connect(ROBOT_ID, timeout_s=WAIT_S)
        robot.is_answering = False
        since_s = time.monotonic()
        async with asyncio.timeout(WAIT_S):
            error = await connection.wait_closed()
        assert error.code == "peer.lost"
        assert time.monotonic() - since_s < 3.5


async def test_closing_is_told_to_the_robot_at_once() -> None:
    async with run() as (robot, operator):
        connection = await operator.connect(ROBOT_ID, timeout_s=WAIT_S)
        byes: asyncio.Queue[Any] = asyncio.Queue()
        heard = robot.heard

        def listening(channel: Any, frame: Frame) -> None:
            with contextlib.suppress(ValueError):
                if b'"bye"' in frame.payload:
                    byes.put_nowait(frame)
            heard(channel, frame)

        robot.heard = listening  # type: ignore[method-assign]
        await connection.close()
        async with asyncio.timeout(WAIT_S):
            await byes.get()


async def test_the_robot_hears_when_the_picture_was_captured_that_a_program_looks_at() -> None:
    async with run() as (robot, operator):
        connection = await operator.connect(ROBOT_ID, timeout_s=WAIT_S)
        await connection.media("front").next_image(WAIT_S)
        async with asyncio.timeout(WAIT_S):
            seen = await robot.seen.get()
        assert seen.capture_us is not None
        assert 0 <= time.monotonic() - seen.capture_us / 1e6 < 3.0


async def test_a_stop_travels_on_its_own_channel_over_real_peers() -> None:
    async with run() as (robot, operator):
        connection = await operator.connect(ROBOT_ID, timeout_s=WAIT_S)
        report = await connection.control.stop("a test")
        assert report.is_safe
        assert not robot.channels["_stop"].is_reliable
        assert robot.stops[0] == ("_stop", "a test")
