"""A robot's side of a peer connection as aiortc's examples write it: its own encoder per peer, its own defaults."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from typing import Any

import av
from aiortc import RTCConfiguration, RTCPeerConnection, RTCSessionDescription, VideoStreamTrack

from mosaic_core.adapters.aiortc_private.rtp.codecs import prefer_codecs
from mosaic_core.adapters.aiortc_private.rtp.senders import RtpOriginLearner
from mosaic_core.runtime.transport.transport import AnswererListener
from mosaic_core.words.signaling import IceCandidate
from video_bench.scene import Image


class NewestPicture:
    """The newest picture, for whoever waits for it; ``post`` is called on any thread."""

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._coming: asyncio.Future[tuple[Image, float]] = self._loop.create_future()

    def post(self, image: Image, at_s: float) -> None:
        self._loop.call_soon_threadsafe(self._arrived, image, at_s)

    def _arrived(self, image: Image, at_s: float) -> None:
        coming, self._coming = self._coming, self._loop.create_future()
        coming.set_result((image, at_s))

    async def next(self) -> tuple[Image, float]:
        return await asyncio.shield(self._coming)


class FilmTrack(VideoStreamTrack):
    """A frame around each picture; aiortc converts and encodes it."""

    def __init__(self, newest: NewestPicture) -> None:
        super().__init__()
        self._newest = newest
        self.last_pts = 0
        self.asked: Callable[[], None] = lambda: None

    async def recv(self) -> Any:
        self.asked()
        image, at_s = await self._newest.next()
        frame = av.VideoFrame.from_ndarray(image, format="bgr24")
        self.last_pts = frame.pts = round(at_s * 90_000)
        frame.time_base = Fraction(1, 90_000)
        return frame


class PlainAnswerer:
    """An ``Answerer`` for one video line."""

    def __init__(self, listener: AnswererListener, newest: NewestPicture, codec: str) -> None:
        self._listener = listener
        self._track = FilmTrack(newest)
        self._codec = codec
        self._peer = RTCPeerConnection(RTCConfiguration(iceServers=[]))
        self._peer.on("connectionstatechange", lambda: listener.state_changed(self._peer.connectionState))

    async def answer(
        self, offer_sdp: str, media_labels: Sequence[str], tracks: Mapping[str, str] | None, sound: object = None
    ) -> str:
        await self._peer.setRemoteDescription(RTCSessionDescription(offer_sdp, "offer"))
        sender = self._peer.addTrack(self._track)
        prefer_codecs(self._peer.getTransceivers()[0], [f"video/{self._codec}"])
        learner, label = RtpOriginLearner(sender), media_labels[0]

        def learn() -> None:
            origin = learner.learn(self._track.last_pts) if self._track.last_pts else None
            if origin is not None:
                self._track.asked = lambda: None
                self._listener.media.origin_known(label, 0, origin)

        self._track.asked = learn
        await self._peer.setLocalDescription(await self._peer.createAnswer())
        return str(self._peer.localDescription.sdp)

    async def add_candidate(self, candidate: IceCandidate) -> None:
        """It meets the operator at the relay."""

    async def close(self) -> None:
        await self._peer.close()
