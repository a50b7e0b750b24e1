"""One camera for its viewers, without a network: who is sent what, and what is encoded for it."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from fractions import Fraction
from typing import Any

import av
import numpy as np
import pytest

from mosaic_core import EncodingParams
from mosaic_core.adapters.video import shared_video
from mosaic_core.adapters.video.encoder_choice import EncoderUnavailable
from mosaic_core.adapters.video.packet_source import SourceState
from mosaic_core.adapters.video.rung_orders import PASSED_ON, SourceShape
from mosaic_core.adapters.video.shared_video import SharedVideo
from mosaic_core.adapters.video.viewer_feed import MAX_WAITING
from mosaic_core.contract.media import Captured
from mosaic_core.machines.congestion.feedback import PictureLost
from mosaic_core.runtime.observation.counters import ConnectorCounters
from mosaic_core.testing import until

WAIT_S = 30.0


class Stage:
    def __init__(self, stream: SharedVideo, counters: ConnectorCounters) -> None:
        self.stream = stream
        self.counters = counters
        self.refused: list[tuple[str, str]] = []
        self._number = 0

    def viewer(self, name: str, mime_type: str = "video/VP8") -> Any:
        feed = self.stream.bind(name, lambda code: self.refused.append((name, code)))
        feed.codec_agreed(mime_type)
        return feed

    def post(self, width: int = 64, height: int = 48) -> bool:
        self._number += 1
        picture = np.full((height, width), self._number % 256, np.uint8)
        return self.stream.offer(Captured(picture, 10 + self._number / 30))

    async def packet(self, feed: Any) -> Any:
        return await asyncio.wait_for(feed.next(), WAIT_S)


@asynccontextmanager
async def stage(**encoding: Any) -> AsyncIterator[Stage]:
    counters = ConnectorCounters()
    stream = SharedVideo("front", EncodingParams(**encoding), counters)
    try:
        yield Stage(stream, counters)
    finally:
        stream.close()


class Found:
    """Encoders of another machine."""

    def __init__(self, preferred_codec: str) -> None:
        self.preferred_codec = preferred_codec
        self.sought = 0

    def seek(self) -> None:
        self.sought += 1


async def test_encoders_are_sought_when_the_camera_is_added_not_when_somebody_looks(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = Found("VP8")
    monkeypatch.setattr(shared_video, "ENCODERS", found)

    async with stage():
        assert found.sought == 1


@pytest.mark.parametrize(
    ("codec", "preferred", "first"),
    [
        ("auto", "VP8", "video/VP8"),
        ("auto", "H264", "video/H264"),
        ("vp8", "H264", "video/VP8"),
        ("h264", "VP8", "video/H264"),
    ],
)
async def test_the_preferred_codec_comes_first_and_the_other_one_is_still_there(
    monkeypatch: pytest.MonkeyPatch, codec: str, preferred: str, first: str
) -> None:
    monkeypatch.setattr(shared_video, "ENCODERS", Found(preferred))

    async with stage(codec=codec) as it:
        order = it.viewer("p1").codec_order
        assert order[0] == first
        assert sorted(order) == ["video/H264", "video/VP8"]


def h264(seconds: int, pixels: int = 64) -> list[Any]:
    """What a camera gives that encodes by itself: ten packets per second, a key frame every second."""
    encoder: Any = av.CodecContext.create("libx264", "w")
    encoder.width, encoder.height, encoder.pix_fmt = pixels, pixels, "yuv420p"
    encoder.time_base, encoder.gop_size = Fraction(1, 10), 10
    encoder.options = {"preset": "ultrafast", "tune": "zerolatency"}
    noise = np.random.default_rng(1)
    packets = []
    for number in range(10 * seconds):
        frame = av.VideoFrame.from_ndarray(noise.integers(0, 255, (pixels, pixels), np.uint8), format="gray")
        frame = frame.reformat(format="yuv420p")
        frame.pts, frame.time_base = number, Fraction(1, 10)
        packets += [av.Packet(bytes(packet)) for packet in encoder.encode(frame)]
    return packets


async def test_packets_decide_the_first_codec_of_whoever_connects_after_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shared_video, "ENCODERS", Found("VP8"))

    async with stage() as it:
        early = it.viewer("early", "video/VP8")
        it.stream.watch("early", True)
        for number, packet in enumerate(h264(1)):
            it.stream.offer(Captured(packet, 10 + number / 10))
        it.stream.offer(Captured(av.Packet(0), 11))  # as a demuxer ends
        assert (await it.packet(early)).is_keyframe, "it gets pictures that are encoded anew"
        assert it.stream.bind("late", print).codec_order[0] == "video/H264"


async def test_a_handler_that_declares_the_codec_of_its_packets_has_it_agreed_at_once() -> None:
    stream = SharedVideo("front", EncodingParams(), ConnectorCounters(), "h264")
    assert stream.bind("p1", print).codec_order[0] == "video/H264"
    stream.close()


async def test_a_source_above_the_ceiling_is_encoded_anew_within_it() -> None:
    for ceiling_bps, is_passed_on in ((200_000, False), (None, True)):
        async with stage(codec="h264", max_bitrate_bps=ceiling_bps) as it:
            feed = it.viewer("p1", "video/H264")
            it.stream.watch("p1", True)
            packets = h264(4, 80)
            assert 250_000 < sum(packet.size for packet in packets) * 8 / 4 < 350_000
            for number, packet in enumerate(packets):
                it.stream.offer(Captured(packet, 10 + number / 10))
                await asyncio.sleep(0)
            await until(lambda: feed.switch.current)  # noqa: B023 - it is called before the next turn
            assert (feed.switch.current == PASSED_ON) is is_passed_on
            assert feed.budget_bps <= (ceiling_bps or 99_000_000)


async def test_a_slow_viewer_goes_on_at_a_key_frame_and_a_quick_one_does_not_notice() -> None:
    async with stage() as it:
        quick, slow = it.viewer("quick"), it.viewer("slow")
        for name in ("quick", "slow"):
            it.stream.watch(name, True)
        it.post()
        assert (await it.packet(slow)).is_keyframe
        sent = []
        for _ in range(30):
            it.post()
            sent.append(await it.packet(quick))
        assert len([packet for packet in sent if packet.is_keyframe]) <= 4
        assert it.counters.dropped > 0
        coming = asyncio.ensure_future(it.packet(slow))
        while not coming.done():
            it.post()
            sent.append(await it.packet(quick))
        behind = len(sent) - 1 - sent.index(await coming)
        assert behind <= MAX_WAITING, "however long it took nothing"
        assert (await coming).is_keyframe


async def test_a_decoder_that_lost_a_picture_gets_a_key_frame() -> None:
    async with stage() as it:
        feed = it.viewer("p1")
        it.stream.watch("p1", True)
        for _ in range(3):
            it.post()
            last = await it.packet(feed)
        assert not last.is_keyframe
        feed.heard(PictureLost())
        is_key = False
        deadline_s = time.monotonic() + WAIT_S
        while not is_key and time.monotonic() < deadline_s:
            it.post()
            is_key = (await it.packet(feed)).is_keyframe
        assert is_key


async def test_a_viewer_that_looks_away_and_back_begins_with_a_key_frame() -> None:
    async with stage() as it:
        other, feed = it.viewer("other"), it.viewer("p1")
        it.stream.watch("other", True)
        it.stream.watch("p1", True)
        it.post()
        await asyncio.gather(it.packet(other), it.packet(feed))
        it.stream.watch("p1", False)
        it.post()
        await it.packet(other)
        it.stream.watch("p1", True)
        taking = asyncio.ensure_future(it.packet(feed))
        while not taking.done():
            it.post()
            await it.packet(other)
        assert (await taking).is_keyframe


async def test_a_camera_that_changes_its_size_goes_on() -> None:
    async with stage(rungs=1) as it:
        feed = it.viewer("p1")
        it.stream.watch("p1", True)
        it.post(64, 48)
        widths = set()
        decoder: Any = av.CodecContext.create("vp8", "r")
        decoder.decode(av.Packet(bytes(await it.packet(feed))))
        while 128 not in widths:
            it.post(128, 96)
            packet = await it.packet(feed)
            widths |= {frame.width for frame in decoder.decode(av.Packet(bytes(packet)))}
        assert len(it.stream.encoders.running) == 1


async def test_pictures_and_bytes_are_counted_once_whatever_the_number_of_viewers() -> None:
    async with stage() as it:
        feeds = [it.viewer(name) for name in ("a", "b", "c")]
        for name in ("a", "b", "c"):
            it.stream.watch(name, True)
        size_bytes = 0
        for _ in range(5):
            it.post()
            packets = await asyncio.gather(*(it.packet(feed) for feed in feeds))
            assert len({bytes(packet) for packet in packets}) == 1
            size_bytes += packets[0].size
        assert (it.counters.messages, it.counters.size_bytes) == (5, size_bytes)


async def test_a_viewer_that_nothing_can_be_encoded_for_is_told_once(monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(*_: Any, **__: Any) -> Any:
        raise EncoderUnavailable("none works", code="media.no_encoder")

    monkeypatch.setattr("mosaic_core.adapters.video.encoder_thread.chosen_kind", nothing)
    async with stage() as it:
        it.viewer("p1")
        it.stream.watch("p1", True)
        it.post()
        await until(lambda: it.refused)
        it.post()
        await asyncio.sleep(0.05)
        assert it.refused == [("p1", "media.no_encoder")]


async def test_packets_that_nobody_can_decode_are_refused_to_those_without_their_codec() -> None:
    async with stage() as it:
        it.viewer("vp8")
        it.viewer("h264", "video/H264")
        for name in ("vp8", "h264"):
            it.stream.watch(name, True)
        it.stream._reshape(SourceShape(packets=SourceState("H264", is_decodable=False)))
        it.stream._reconsider()
        assert it.refused == [("vp8", "media.not_decodable")]


async def test_a_loop_that_was_busy_for_long_starts_over_at_a_key_frame(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shared_video, "_MAX_HANDED_OVER", 4)

    async with stage() as it:
        feed = it.viewer("p1")
        it.stream.watch("p1", True)
        it.post()
        await it.packet(feed)
        before = it.stream.encoders.encoded
        while it.stream.encoders.encoded < before + 8:  # the loop gets no turn meanwhile
            it.post()
            time.sleep(0.002)  # noqa: ASYNC251 - a loop that is held up is what this is about
        assert it.stream._has_overflowed
        last, deadline_s = None, time.monotonic() + WAIT_S
        while time.monotonic() < deadline_s and not (last is not None and last.is_keyframe):
            it.post()
            last = await it.packet(feed)
        assert last is not None
        assert last.is_keyframe
        assert not it.stream._has_overflowed


async def test_coming_and_going_leaves_nothing_behind() -> None:
    async with stage() as it:
        it.post()
        for number in range(60):
            feed = it.viewer(f"p{number}", "video/H264" if number % 3 == 0 else "video/VP8")
            it.stream.watch(f"p{number}", True)
            it.post()
            assert (await it.packet(feed)).is_keyframe
            it.stream.leave(f"p{number}")
            assert it.stream.encoders.running == ()
        await until(lambda: not [one for one in threading.enumerate() if one.name == "encode front"])
        assert it.stream._viewers == it.stream._watching == {}


async def test_closing_ends_the_encoders_and_everything_else() -> None:
    async with stage() as it:
        feed = it.viewer("p1")
        it.stream.watch("p1", True)
        it.post()
        await it.packet(feed)
        it.stream.close()
        assert it.stream.encoders.running == ()
        assert it.post() is False
