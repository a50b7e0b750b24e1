"""One camera, several operators over real peer connections: one encoder, and everybody sees the picture."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import AsyncIterator, Callable
from contextlib import AsyncExitStack, asynccontextmanager
from fractions import Fraction
from typing import Any, cast

import av
import numpy as np
import pytest

from mosaic_core import Captured, EncodingParams
from mosaic_core.adapters.peers.aiortc_answerer import AiortcAnswerer
from mosaic_core.adapters.video.rung_orders import PASSED_ON
from mosaic_core.adapters.video.shared_video import SharedVideo
from mosaic_core.laboratory.impaired_answerer import impaired
from mosaic_core.laboratory.impaired_path import ImpairedPath
from mosaic_core.machines.congestion.budget_allocator import Demand
from mosaic_core.machines.laboratory.impaired_link import LinkProfile
from mosaic_core.runtime.observation.counters import ConnectorCounters
from mosaic_core.testing import until

pytestmark = pytest.mark.webrtc
WAIT_S = 20.0
FPS = 20
AT_ONCE = 2 * FPS
"""Pictures of the camera: a clock that a busy machine holds up with everything else."""
LOST = 3
"""So many packets have to be lost before a link counts as lossy."""


def scene(width: int = 320, height: int = 240) -> np.ndarray[Any, Any]:
    image = np.zeros((height, width, 3), np.uint8)
    image[:, :, 0] = np.linspace(0, 160, width, dtype=np.uint8)
    image[height // 4 : height // 2, width // 4 : width // 2] = (40, 220, 240)
    return image


def shows(frame: Any, image: np.ndarray[Any, Any]) -> bool:
    shown = frame.to_ndarray(format="bgr24").astype(int)
    rows = np.arange(shown.shape[0]) * image.shape[0] // shown.shape[0]
    columns = np.arange(shown.shape[1]) * image.shape[1] // shown.shape[1]
    return bool(np.abs(shown - image[rows][:, columns]).mean() < 14)


class Filming:
    """A camera on a thread of its own, as a handler has one."""

    def __init__(self, stream: SharedVideo, picture: Callable[[], Any]) -> None:
        self.posted = 0
        self._stream = stream
        self._picture = picture
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._film)
        self._thread.start()

    def _film(self) -> None:
        while not self._is_over.wait(1 / FPS):
            self.posted += self._stream.offer(Captured(self._picture(), time.monotonic()))

    def end(self) -> None:
        self._is_over.set()
        self._thread.join()


class Studio:
    """One stream and its operators."""

    def __init__(self, pair: Any, encoding: EncodingParams, stack: AsyncExitStack, packet_codec: Any) -> None:
        self.stream = SharedVideo("front", encoding, ConnectorCounters(), packet_codec)
        self._pair = pair
        self._stack = stack

    def film(self, picture: Callable[[], Any] = scene) -> Filming:
        filming = Filming(self.stream, picture)
        self._stack.callback(filming.end)
        return filming

    async def operator(self, *, without: str = "", path: ImpairedPath | None = None) -> Operator:
        """Another one connects; ``without``: a codec that it does not have."""
        peers = await self._stack.enter_async_context(self._pair())
        peers.robot_side.streams["front"] = self.stream
        if path is not None:
            peers.robot = impaired(AiortcAnswerer, path)(peers.robot_side, ())
            peers.operator_side.other = peers.robot
        if without:
            offer = peers.operator.offer

            async def poorer() -> Any:
                sdp, tracks = await offer()
                return sdp.replace(f"{without}/90000", "X/90000"), tracks

            peers.operator.offer = poorer
        peers.operator.add_video("front")
        await peers.join(["front"])
        _, track = await asyncio.wait_for(peers.operator_side.tracks.get(), WAIT_S)
        return Operator(peers, track)


class Operator:
    def __init__(self, peers: Any, track: Any) -> None:
        self.peers = peers
        self._track = track

    def watch(self, on: bool = True) -> None:
        self.peers.robot_side.watch("front", on)

    @property
    def feed(self) -> Any:
        return self.peers.robot_side.stream("front").bind(str(id(self.peers.robot_side)), print)

    async def sees(self, image: np.ndarray[Any, Any], frames: int = 5) -> None:
        """So many pictures that show ``image``."""
        seen = 0
        while seen < frames:
            seen += shows(await self.next(), image)

    async def next(self) -> Any:
        return await asyncio.wait_for(self._track.next(), WAIT_S)


@pytest.fixture
def studio(pair: Any) -> Any:
    @asynccontextmanager
    async def opened(packet_codec: Any = None, **encoding: Any) -> AsyncIterator[Studio]:
        async with AsyncExitStack() as stack:
            made = Studio(pair, EncodingParams(**encoding), stack, packet_codec)
            stack.callback(made.stream.close)
            yield made

    return opened


async def test_three_operators_share_one_encoder_and_all_see_the_picture(studio: Any) -> None:
    async with studio() as it:
        operators = [await it.operator() for _ in range(3)]
        for operator in operators:
            operator.watch()
        filming = it.film()
        await asyncio.gather(*(operator.sees(scene()) for operator in operators))
        assert len(it.stream.encoders.running) == 1
        assert it.stream.encoders.encoded <= filming.posted + 3, "each picture once, whatever the number of viewers"


async def test_nobody_watching_nothing_is_encoded_and_the_last_one_to_leave_ends_the_encoder(studio: Any) -> None:
    async with studio() as it:
        first, second = await it.operator(), await it.operator()
        filming = it.film()
        await asyncio.sleep(3 / FPS)
        assert filming.posted == 0
        assert it.stream.encoders.running == ()
        first.watch()
        second.watch()
        await asyncio.gather(first.sees(scene()), second.sees(scene()))
        first.watch(False)
        await second.sees(scene(), 3)
        second.watch(False)
        assert it.stream.encoders.running == ()
        await until(lambda: "encode front" not in {thread.name for thread in threading.enumerate()})


async def test_a_late_joiner_gets_its_picture_at_once(studio: Any) -> None:
    async with studio() as it:
        first, late = await it.operator(), await it.operator()
        filming = it.film()
        first.watch()
        await first.sees(scene(), 20)
        late.watch()
        posted = filming.posted
        await late.sees(scene(), 1)
        assert filming.posted < posted + AT_ONCE
        await late.sees(scene())
        assert len(it.stream.encoders.running) == 1


@pytest.mark.parametrize("codec", ["vp8", "h264"])
async def test_each_operator_gets_a_codec_that_it_has(studio: Any, codec: str) -> None:
    async with studio(codec=codec) as it:
        plain, only_vp8, only_h264 = (
            await it.operator(),
            await it.operator(without="H264"),
            await it.operator(without="VP8"),
        )
        it.film()
        for operator in (plain, only_vp8, only_h264):
            operator.watch()
        await asyncio.gather(plain.sees(scene()), only_vp8.sees(scene()), only_h264.sees(scene()))
        assert (only_vp8.feed.codec, only_h264.feed.codec) == ("VP8", "H264")
        assert plain.feed.codec == codec.upper()
        assert len(it.stream.encoders.running) == 2


async def test_a_worse_link_gets_a_smaller_picture_without_a_gap_and_others_keep_theirs(studio: Any) -> None:
    async with studio(max_bitrate_bps=700_000) as it:
        good, bad = await it.operator(), await it.operator()
        it.film(lambda: scene(640, 480))
        good.watch()
        bad.watch()
        await asyncio.gather(good.sees(scene()), bad.sees(scene()))
        for one, most_bps in ((good, 700_000), (bad, 200_000)):  # whatever a busy machine makes of its path
            one.feed.connection.want(one.feed, Demand(most_bps, most_bps), lambda: None)
        last_pts, width = -1, 640
        while width == 640:
            frame = await bad.next()
            assert frame.pts > last_pts
            last_pts, width = frame.pts, frame.width
            assert shows(frame, scene()) or frame.width == 640
        assert width < 640
        await bad.sees(scene())
        await good.sees(scene())
        assert (await good.next()).width == 640
        assert len(it.stream.encoders.running) == 2


async def test_a_lossy_link_still_shows_the_picture(studio: Any) -> None:
    with ImpairedPath() as path:
        async with studio() as it:
            operator = await it.operator(path=path)
            it.film()
            operator.watch()
            path.become(LinkProfile("lossy", delay_ms=10, loss=0.05))
            async with asyncio.timeout(WAIT_S):
                while path.down.lost < LOST:
                    await operator.sees(scene(), 1)
            await operator.sees(scene(), 20)


def packets_of(image: np.ndarray[Any, Any]) -> Callable[[], Any]:
    """A camera that encodes by itself: H.264, a key frame every second."""
    encoder = cast(Any, av.CodecContext.create("libx264", "w"))
    encoder.width, encoder.height, encoder.pix_fmt = image.shape[1], image.shape[0], "yuv420p"
    encoder.time_base, encoder.gop_size = Fraction(1, FPS), FPS
    encoder.options = {"preset": "ultrafast", "tune": "zerolatency"}
    pictures = iter(range(1_000_000))

    def encoded() -> Any:
        frame = av.VideoFrame.from_ndarray(image, format="bgr24")
        frame.pts, frame.time_base = next(pictures), Fraction(1, FPS)
        return av.Packet(bytes(encoder.encode(frame)[0]))

    return encoded


async def test_packets_are_passed_on_as_they_are_and_encoded_anew_only_for_another_codec(studio: Any) -> None:
    async with studio(packet_codec="h264") as it:
        h264, vp8 = await it.operator(), await it.operator(without="H264")
        it.film(packets_of(scene()))
        h264.watch()
        await h264.sees(scene(), 10)
        assert h264.feed.switch.current == PASSED_ON
        assert not it.stream.encoders.running
        vp8.watch()
        await asyncio.gather(vp8.sees(scene(), 10), h264.sees(scene(), 10))
        assert [key.codec for key in it.stream.encoders.running] == ["VP8"]


async def test_who_connects_after_the_first_packets_has_them_passed_on_though_nobody_declared_them(studio: Any) -> None:
    async with studio() as it:
        early = await it.operator(without="H264")
        it.film(packets_of(scene()))
        early.watch()
        await early.sees(scene(), 5)
        late = await it.operator()
        late.watch()
        await late.sees(scene(), 10)
        assert late.feed.switch.current == PASSED_ON
        assert early.feed.codec == "VP8", "what was agreed stays"
