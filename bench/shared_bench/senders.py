"""A robot with several cameras in the robot's network: ours, and plain aiortc; each in a process of its own."""

from __future__ import annotations

import asyncio
import multiprocessing
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

from aiortc import RTCConfiguration, RTCDataChannel, RTCPeerConnection, RTCSessionDescription
from laboratory.networks import Namespace
from video_bench.listener import CameraListener
from video_bench.plain_aiortc import FilmTrack, NewestPicture
from video_bench.scene import Image

from mosaic_core.contract.media import Captured
from mosaic_core.runtime.transport.peer_congestion import PeerCongestion
from shared_bench.noise import FilmCamera, NoiseCamera, PostingCamera

PATIENCE_S = 40.0
CUT = "cut"
READING_S = 0.02
MESSAGE, FULL_BYTES = bytes(16 * 1024), 64 * 1024
"""Of a bulk transfer: so much waits for the network."""


@dataclass(frozen=True, slots=True)
class Cameras:
    """What a robot films. ``late``: so many of them are asked for by an order only, as when somebody opens a card;
    ``sensor_bps``: of ordinary data beside them; ``film``: a file that they show instead of noise."""

    sender: str
    count: int
    size: tuple[int, int]
    fps: float
    late: int = 0
    seed: int = 1
    sensor_bps: float = 0.0
    film: str = ""

    def begun(self, number: int, post: Callable[[Image, float], object]) -> PostingCamera:
        seed = 10 * self.seed + number
        if self.film:
            return FilmCamera(self.film, self.size, self.fps, seed, post)
        return NoiseCamera(self.size, self.fps, seed, post)


class CamerasProcess:
    """The other process, from this side."""

    def __init__(self, cameras: Cameras, namespace: Namespace) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=serve, args=(theirs, cameras), daemon=True)
        namespace.run(self._process.start)
        theirs.close()

    async def answer(self, offer_sdp: str) -> str:
        self._pipe.send(offer_sdp)
        return await asyncio.to_thread(self._received)

    async def answer_bulk(self, offer_sdp: str) -> str:
        """Of a second connection, on which data is sent as fast as it is taken from now on."""
        return await self.answer(offer_sdp)

    def order(self, what: str) -> None:
        """:data:`CUT`, or the label of a camera that is wanted from now on."""
        self._pipe.send(what)

    async def close(self) -> None:
        self._pipe.close()
        await asyncio.to_thread(self._process.join, 10)
        if self._process.is_alive():
            self._process.kill()

    def _received(self) -> str:
        if not self._pipe.poll(PATIENCE_S):
            raise TimeoutError("the sender's process does not answer")
        return str(self._pipe.recv())


# -- the sender's process ----------------------------------------------------------------------------------------------


def serve(pipe: Connection, cameras: Cameras) -> None:
    from mosaic_core.adapters.machine.event_loop import run_event_loop

    run_event_loop(_served(pipe, cameras))


async def _served(pipe: Connection, cameras: Cameras) -> None:
    robot = OurCameras(cameras) if cameras.sender == "ours" else AiortcCameras(cameras)
    pipe.send(await robot.answer(await asyncio.to_thread(pipe.recv)))
    films = [cameras.begun(number, robot.post(number)) for number in range(cameras.count)]
    while (order := await asyncio.to_thread(_next, pipe)) is not None:
        if order == CUT:
            for film in films:
                film.cut()
        elif order.startswith("v=0"):
            pipe.send(await robot.answer_bulk(order))
        else:
            robot.watch(order)
    for film in films:
        film.end()
    await robot.close()


def _next(pipe: Connection) -> str | None:
    try:
        return str(pipe.recv())
    except (EOFError, ConnectionResetError):
        return None


class OurCameras:
    """Cameras of the robot as it is."""

    def __init__(self, cameras: Cameras) -> None:
        from mosaic_core import EncodingParams
        from mosaic_core.adapters.peers.aiortc_answerer import AiortcAnswerer
        from mosaic_core.adapters.video.shared_video import SharedVideo
        from mosaic_core.runtime.observation.counters import ConnectorCounters

        labels = [f"camera{number}" for number in range(cameras.count)]
        self._streams = {label: SharedVideo(label, EncodingParams(), ConnectorCounters()) for label in labels}
        self._listener = SensorListener(cameras.sensor_bps, self._streams, later=labels[cameras.count - cameras.late :])
        self._answerer = AiortcAnswerer(self._listener, ())
        self._bulk = AiortcAnswerer(FloodListener(self._listener.congestion), ())
        self.watch = self._listener.watch

    async def answer(self, offer_sdp: str) -> str:
        return await self._answerer.answer(offer_sdp, list(self._streams), None)

    async def answer_bulk(self, offer_sdp: str) -> str:
        return await self._bulk.answer(offer_sdp, (), None)

    def post(self, number: int) -> Any:
        stream = self._streams[f"camera{number}"]
        return lambda image, at_s: stream.offer(Captured(image, at_s))

    async def close(self) -> None:
        self._listener.end()
        await self._bulk.close()
        await self._answerer.close()
        for stream in self._streams.values():
            stream.close()


class SensorListener(CameraListener):
    """Sends readings on the one channel of the viewer, beside the pictures."""

    def __init__(self, bps: float, *words: Any, **more: Any) -> None:
        super().__init__(*words, **more)
        self._reading = bytes(round(bps / 8 * READING_S))
        self._sending: asyncio.Task[None] | None = None

    def channel_opened(self, channel: Any) -> None:
        self._sending = asyncio.ensure_future(self._send(channel))

    def end(self) -> None:
        if self._sending is not None:
            self._sending.cancel()

    async def _send(self, channel: Any) -> None:
        while True:
            if channel.is_open:
                channel.send(self._reading)
            await asyncio.sleep(READING_S)


class FloodListener:
    """Sends as much as is taken on the one channel of a second connection, an ``AnswererListener``."""

    is_local = True

    def __init__(self, congestion: PeerCongestion) -> None:
        self.media, self.congestion = self, congestion

    def channel_opened(self, channel: Any) -> None:
        channel.give_way(True)

        def refill() -> None:
            while channel.buffered_bytes < FULL_BYTES:
                channel.send(MESSAGE)

        channel.on_drained = refill
        refill()

    def state_changed(self, state: str) -> None: ...
    def bound_exceeded(self, why: str) -> None: ...
    def candidate_found(self, candidate: Any) -> None: ...
    def tracks_unbound(self, labels: Any) -> None: ...


class AiortcCameras:
    """aiortc as its examples use it: an encoder per line, its own bit rates."""

    def __init__(self, cameras: Cameras) -> None:
        self._newest = [NewestPicture() for _ in range(cameras.count)]
        self._peer = RTCPeerConnection(RTCConfiguration(iceServers=[]))
        self._bulk: RTCPeerConnection | None = None

    async def answer(self, offer_sdp: str) -> str:
        await self._peer.setRemoteDescription(RTCSessionDescription(offer_sdp, "offer"))
        for newest in self._newest:
            self._peer.addTrack(FilmTrack(newest))
        await self._peer.setLocalDescription(await self._peer.createAnswer())
        return self._peer.localDescription.sdp

    def post(self, number: int) -> Any:
        newest: NewestPicture = self._newest[number]

        def posted(image: Image, at_s: float) -> None:
            newest.post(image, at_s)

        return posted

    async def answer_bulk(self, offer_sdp: str) -> str:
        peer = self._bulk = RTCPeerConnection(RTCConfiguration(iceServers=[]))

        @peer.on("datachannel")
        def arrived(channel: RTCDataChannel) -> None:
            def refill() -> None:
                while channel.bufferedAmount < FULL_BYTES:
                    channel.send(MESSAGE)

            channel.bufferedAmountLowThreshold = FULL_BYTES // 2
            channel.on("bufferedamountlow", refill)
            refill()

        await peer.setRemoteDescription(RTCSessionDescription(offer_sdp, "offer"))
        await peer.setLocalDescription(await peer.createAnswer())
        return peer.localDescription.sdp

    def watch(self, label: str) -> None:
        """Every line sends from the beginning."""

    async def close(self) -> None:
        if self._bulk is not None:
            await self._bulk.close()
        await self._peer.close()
