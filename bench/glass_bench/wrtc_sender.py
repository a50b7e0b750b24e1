"""Native libwebrtc from Python (`wrtc` on PyPI), with its own pacing, bit rates and VP8 encoder."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from typing import Any

import cv2
import webrtc  # type: ignore[import-not-found,unused-ignore]
from video_bench.scene import Image

GATHERING_S = 2.0


class WrtcSender:
    def __init__(self, size: tuple[int, int]) -> None:
        self._size = size
        self._loop = asyncio.get_running_loop()
        self._peer: Any = webrtc.RTCPeerConnection()
        self._generator: Any = webrtc.VideoTrackGenerator()
        self._writer: Any = self._generator.writable.get_writer()
        self._is_gathered = asyncio.Event()
        self._writes: set[asyncio.Future[Any]] = set()

    async def answer(self, offer_sdp: str) -> str:
        peer = self._peer
        await peer.set_remote_description(webrtc.RTCSessionDescriptionInit(type="offer", sdp=offer_sdp))
        peer.add_track(self._generator.track)
        peer.on("icegatheringstatechange", self._look)
        await peer.set_local_description()
        with suppress(TimeoutError):
            await asyncio.wait_for(self._is_gathered.wait(), GATHERING_S)
        return str(peer.local_description.sdp)

    def _look(self, _: object) -> None:
        if self._peer.ice_gathering_state == "complete":
            self._is_gathered.set()

    def post(self, image: Image, captured_at_s: float) -> None:
        i420 = cv2.cvtColor(image, cv2.COLOR_BGR2YUV_I420).tobytes()
        self._loop.call_soon_threadsafe(self._write, i420, round(captured_at_s * 1e6))

    def _write(self, i420: bytes, timestamp_us: int) -> None:
        width, height = self._size
        init = webrtc.VideoFrameBufferInit(
            format="I420", coded_width=width, coded_height=height, timestamp=timestamp_us
        )
        writing = asyncio.ensure_future(self._writer.write(webrtc.VideoFrame(i420, init)))
        self._writes.add(writing)
        writing.add_done_callback(self._writes.discard)

    async def close(self) -> None:
        self._peer.close()
