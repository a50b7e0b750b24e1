"""What a robot's process spends on one camera for so many operators: with our shared encoder, with aiortc's own encoder
per peer, and with GStreamer's webrtcbin. Robot and operators are processes of their own, on loopback.
"""

from __future__ import annotations

import asyncio
import multiprocessing
import threading
import time
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from fractions import Fraction
from multiprocessing.connection import Connection
from typing import Any, Literal

from video_bench.listener import CameraListener
from video_bench.scene import Image, scene
from video_bench.serving import BITRATE_BPS, Camera, serve
from video_bench.viewers import view

WARM_UP_S, MEASURED_S = 3.0, 4.0
Way = Literal["ours", "aiortc", "webrtcbin", "webrtcbin, one encoder"]


@dataclass(frozen=True, slots=True)
class Spent:
    """CPU seconds per second: in encoders (with what converts for them), and in the whole process; and what each
    operator got."""

    encoder: float
    process: float
    fps_per_viewer: float


def spent(way: Way, codec: str, size: tuple[int, int], viewers: int) -> Spent:
    """One run. Raises :class:`RuntimeError` if a process ends early."""
    context = multiprocessing.get_context("spawn")
    to_robot, to_viewers = context.Pipe()
    robot_orders, robot_end = context.Pipe()
    viewer_orders, viewer_end = context.Pipe()
    robot = context.Process(target=_robot, args=(to_robot, robot_end, way, codec, size, viewers))
    audience = context.Process(target=view, args=(to_viewers, viewer_end, viewers))
    robot.start()
    audience.start()
    try:
        _expect(robot_orders, "ready")
        time.sleep(WARM_UP_S)
        before = [_asked(robot_orders, "spent"), _asked(viewer_orders, "count"), time.monotonic()]
        time.sleep(MEASURED_S)
        after = [_asked(robot_orders, "spent"), _asked(viewer_orders, "count"), time.monotonic()]
        seconds = after[2] - before[2]
        encoder, process = ((late - early) / seconds for late, early in zip(after[0], before[0], strict=True))
        return Spent(encoder, process, (after[1] - before[1]) / seconds / viewers)
    finally:
        for orders in (viewer_orders, robot_orders):
            orders.send("end")
        for child in (audience, robot):
            child.join(10)
            if child.is_alive():
                child.terminate()


def _asked(orders: Connection, what: str) -> Any:
    orders.send(what)
    return _received(orders)


def _expect(orders: Connection, what: str) -> None:
    if _received(orders) != what:
        raise RuntimeError("the robot's process is out of step")


def _received(orders: Connection) -> Any:
    if not orders.poll(60):
        raise RuntimeError("a process of the benchmark does not answer")
    return orders.recv()


# -- the robot's process -----------------------------------------------------------------------------------------------


def _robot(viewers_pipe: Connection, orders: Connection, way: Way, codec: str, size: tuple[int, int], n: int) -> None:
    from mosaic_core.adapters.machine.event_loop import run_event_loop

    run_event_loop(_side(viewers_pipe, orders, way, codec, scene(*size), n))


def _side(
    pipe: Connection, orders: Connection, way: Way, codec: str, pictures: list[Image], n: int
) -> Coroutine[Any, Any, None]:
    match way:
        case "ours":
            return _ours(pipe, orders, codec, pictures, n)
        case "aiortc":
            return _aiortc(pipe, orders, codec, pictures, n)
        case "webrtcbin":
            from video_bench.webrtcbin import serve_each

            return serve_each(pipe, orders, pictures, n)
    from video_bench.webrtcbin import serve_shared

    return serve_shared(pipe, orders, pictures, n)


async def _ours(pipe: Connection, orders: Connection, codec: str, pictures: list[Image], n: int) -> None:
    from mosaic_core import Captured, EncodingParams
    from mosaic_core.adapters.peers.aiortc_answerer import AiortcAnswerer
    from mosaic_core.adapters.video.shared_video import SharedVideo
    from mosaic_core.runtime.observation.counters import ConnectorCounters

    encoding = EncodingParams(codec=codec, rungs=1, max_bitrate_bps=BITRATE_BPS, min_bitrate_bps=BITRATE_BPS)
    stream = SharedVideo("front", encoding, ConnectorCounters())
    answerers = []
    for number in range(n):
        offer = await asyncio.to_thread(pipe.recv)
        answerers.append(AiortcAnswerer(CameraListener({"front": stream}, str(number)), ()))
        pipe.send(await answerers[-1].answer(offer, ["front"], None))
    camera = Camera(pictures, lambda image, at_s: stream.offer(Captured(image, at_s)))
    await serve(orders, lambda: stream.encoders.cpu_s + camera.cpu_s)
    camera.end()
    await asyncio.gather(*(answerer.close() for answerer in answerers))
    stream.close()


async def _aiortc(pipe: Connection, orders: Connection, codec: str, pictures: list[Image], n: int) -> None:
    import av
    from aiortc import RTCConfiguration, RTCPeerConnection, RTCSessionDescription, VideoStreamTrack
    from aiortc.codecs.h264 import H264Encoder
    from aiortc.codecs.vpx import Vp8Encoder

    from mosaic_core.adapters.aiortc_private.rtp.codecs import prefer_codecs

    used = _time_encoding(H264Encoder if codec == "h264" else Vp8Encoder)
    newest = _Newest()
    camera = Camera(pictures, newest.post(asyncio.get_running_loop()))

    class Track(VideoStreamTrack):
        """As aiortc's examples make one: a frame around the picture; aiortc converts and encodes it."""

        async def recv(self) -> Any:
            image, at_s = await newest.next()
            frame = av.VideoFrame.from_ndarray(image, format="bgr24")
            frame.pts, frame.time_base = round(at_s * 90_000), Fraction(1, 90_000)
            return frame

    peers = []
    for _ in range(n):
        peer = RTCPeerConnection(RTCConfiguration(iceServers=[]))
        peers.append(peer)
        await peer.setRemoteDescription(RTCSessionDescription(await asyncio.to_thread(pipe.recv), "offer"))
        peer.addTrack(Track())
        prefer_codecs(peer.getTransceivers()[0], [f"video/{codec}"])
        await peer.setLocalDescription(await peer.createAnswer())
        pipe.send(peer.localDescription.sdp)
    await serve(orders, lambda: used[0])
    camera.end()
    await asyncio.gather(*(peer.close() for peer in peers))


class _Newest:
    """The newest picture, for whoever waits for it."""

    def __init__(self) -> None:
        self._coming: asyncio.Future[tuple[Image, float]] = asyncio.get_running_loop().create_future()

    def post(self, loop: asyncio.AbstractEventLoop) -> Callable[[Image, float], object]:
        return lambda image, at_s: loop.call_soon_threadsafe(self._arrived, image, at_s)

    def _arrived(self, image: Image, at_s: float) -> None:
        coming, self._coming = self._coming, asyncio.get_running_loop().create_future()
        coming.set_result((image, at_s))

    async def next(self) -> tuple[Image, float]:
        return await asyncio.shield(self._coming)


def _time_encoding(encoder: Any) -> list[float]:
    """CPU seconds of all calls of its ``encode``, each of which stays on one thread."""
    used, lock, encode = [0.0], threading.Lock(), encoder.encode

    def timed(self: Any, *args: Any) -> Any:
        began_s = time.thread_time()
        try:
            return encode(self, *args)
        finally:
            with lock:
                used[0] += time.thread_time() - began_s

    encoder.encode = timed
    return used
