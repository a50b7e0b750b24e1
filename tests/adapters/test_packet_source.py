"""Packets that came encoded: what they are, whether they are key frames, and their pictures for those who need some."""

from __future__ import annotations

from fractions import Fraction
from types import SimpleNamespace
from typing import Any, cast

import av
import numpy as np
import pytest

from mosaic_core.adapters.packet_source import PacketSource, SourceState, is_h264_key_frame
from mosaic_core.adapters.picture import VIDEO_TIME_BASE, prepared_picture
from mosaic_core.adapters.rung_orders import PASSED_ON, SourceShape, limits_bps, options_of
from mosaic_core.contract.media import EncodingParams
from mosaic_core.machines.rate_control import START_BPS


def h264(count: int, key_every: int = 10) -> list[Any]:
    """Bare packets, 30 per second, stamped as the stream stamps them."""
    encoder = cast(Any, av.CodecContext.create("libx264", "w"))
    encoder.width, encoder.height, encoder.pix_fmt = 64, 48, "yuv420p"
    encoder.time_base, encoder.gop_size = Fraction(1, 30), key_every
    encoder.options = {"preset": "ultrafast", "tune": "zerolatency"}
    packets = []
    for number in range(count):
        frame = av.VideoFrame.from_ndarray(np.full((48, 64, 3), number % 256, np.uint8), format="bgr24")
        frame.pts, frame.time_base = number, Fraction(1, 30)
        (packet,) = encoder.encode(frame)
        packets.append(prepared_picture(av.Packet(bytes(packet)), 10 + number / 30))
    return packets


def of_codec(name: str) -> Any:
    """A packet as a demuxer gives it; PyAV lets nobody make such a one without a file."""
    context = SimpleNamespace(name=name, extradata=None)
    return SimpleNamespace(
        stream=SimpleNamespace(codec_context=context), is_keyframe=True, size=100, pts=0, time_base=VIDEO_TIME_BASE
    )


def test_bare_packets_are_h264_and_their_key_frames_are_found() -> None:
    source, packets = PacketSource("front"), h264(21)
    for packet in packets:
        source.take(packet)
    assert source.state.sendable_as == "H264"
    assert [number for number, packet in enumerate(packets) if packet.is_keyframe] == [0, 10, 20]


@pytest.mark.parametrize(("name", "expected"), [("h264", "H264"), ("vp8", "VP8"), ("hevc", None), ("mjpeg", None)])
def test_the_streams_codec_says_whether_packets_can_be_sent(name: str, expected: str | None) -> None:
    source = PacketSource("front")
    source.take(of_codec(name))
    assert source.state.sendable_as == expected


def test_the_bit_rate_becomes_known_within_two_seconds() -> None:
    source, packets = PacketSource("front"), h264(90)
    for packet in packets:
        source.take(packet)
    true_bps = sum(packet.size for packet in packets) * 8 / 3
    assert source.state.bitrate_bps == pytest.approx(true_bps, rel=0.5)


def test_pictures_begin_at_a_key_frame_and_keep_their_capture_times() -> None:
    source, packets = PacketSource("front"), h264(21)
    for packet in packets:
        source.take(packet)
    assert [source.pictures(packet) for packet in packets[1:10]] == [[]] * 9
    pictures = [picture for packet in packets[10:] for picture in source.pictures(packet)]
    assert [picture.pts for picture in pictures] == [packet.pts for packet in packets[10:]]
    assert pictures[0].format.name == "yuv420p"
    source.rest()
    assert source.pictures(packets[11]) == [], "it starts over at a key frame"


def test_damage_costs_pictures_until_the_next_key_frame_only() -> None:
    source, packets = PacketSource("front"), h264(21)
    for packet in packets:
        source.take(packet)
    broken = prepared_picture(av.Packet(b"\x00\x00\x00\x01\x65garbage"), 11.0)
    assert source.pictures(packets[0])
    source.pictures(cast(Any, broken))
    assert source.pictures(packets[20])


def test_a_codec_that_nothing_here_decodes_is_hopeless_for_those_without_it(caplog: pytest.LogCaptureFixture) -> None:
    source, packet = PacketSource("front"), of_codec("no_such_codec")
    source.take(packet)
    assert source.pictures(packet) == []
    assert not source.state.is_decodable
    shape = SourceShape().with_packets(source.state)
    assert shape.is_hopeless("VP8")
    assert not SourceShape().with_packets(SourceState("H264", is_decodable=False)).is_hopeless("H264")
    assert any("no_such_codec" in record.message for record in caplog.records)


def test_a_viewer_of_the_sources_codec_gets_its_packets_and_cheaper_rungs_below() -> None:
    state = SourceState("H264", bitrate_bps=2_000_000)
    shape = SourceShape().with_size((1280, 720)).with_packets(state)
    own, *cheaper = options_of("H264", shape, EncodingParams())
    assert own[0] == PASSED_ON
    assert own[1].floor_bps == 1_500_000
    assert cheaper
    assert all(rung.ceiling_bps < 2_000_000 for _, rung in cheaper)
    assert PASSED_ON not in dict(options_of("VP8", shape, EncodingParams()))
    assert limits_bps(shape, EncodingParams()) == (150_000, 4_000_000)
    assert limits_bps(SourceShape(packets=SourceState("H264")), EncodingParams()) == (150_000, START_BPS)


def test_while_nothing_is_known_there_is_nothing_to_choose() -> None:
    assert options_of("VP8", SourceShape(), EncodingParams()) == []
    assert options_of(None, SourceShape(size=(640, 480)), EncodingParams()) == []


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        (b"\x00\x00\x00\x01\x67a\x00\x00\x01\x68b\x00\x00\x01\x65c", True),
        (b"\x00\x00\x00\x01\x41abc", False),
        (b"\x00\x00\x01", False),
        (b"", False),
    ],
)
def test_a_key_frame_is_an_idr_picture(data: bytes, expected: bool) -> None:
    assert is_h264_key_frame(data) is expected
