"""Packets that came encoded: what they are, whether they are key frames, and their pictures for those who need some."""

from __future__ import annotations

import logging
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import av
import numpy as np
import pytest

from mosaic_core.adapters.video.packet_source import PassedPackets, SourceState
from mosaic_core.adapters.video.picture_clock import VIDEO_TIME_BASE, stamped
from mosaic_core.adapters.video.rung_orders import PASSED_ON, SourceShape, codecs_of, limits_bps, options_of
from mosaic_core.contract.media import EncodingParams
from mosaic_core.machines.congestion.rate_control import START_BPS

OPTIONS = {
    "libx264": {"preset": "ultrafast", "tune": "zerolatency"},
    "libvpx": {"deadline": "realtime", "lag-in-frames": "0"},
    "mjpeg": {"color_range": "pc"},
}


def encoded(name: str, count: int, key_every: int = 10) -> list[Any]:
    """Bare packets, 30 per second, stamped as the stream stamps them."""
    encoder = cast(Any, av.CodecContext.create(name, "w"))
    encoder.width, encoder.height, encoder.pix_fmt = 64, 48, "yuv420p"
    encoder.time_base, encoder.gop_size = Fraction(1, 30), key_every
    encoder.options = OPTIONS[name]
    packets = []
    for number in range(count):
        frame = av.VideoFrame.from_ndarray(np.full((48, 64, 3), number % 256, np.uint8), format="bgr24")
        frame.pts, frame.time_base = number, Fraction(1, 30)
        (packet,) = encoder.encode(frame)
        packets.append(stamped(av.Packet(bytes(packet)), 10 + number / 30))
    return packets


def h264(count: int, key_every: int = 10) -> list[Any]:
    return encoded("libx264", count, key_every)


def recorded(path: Path, count: int = 12, b_frames: int = 0) -> list[Any]:
    """The packets of a recording, every fourth a key frame, as a demuxer gives them, stamped; its last one is empty."""
    with av.open(str(path), "w") as container:
        stream = cast(Any, container.add_stream("libx264", rate=30))
        stream.width, stream.height, stream.pix_fmt = 320, 240, "yuv420p"
        stream.codec_context.gop_size, stream.codec_context.max_b_frames = 4, b_frames
        stream.options = {"preset": "ultrafast", "x264-params": f"bframes={b_frames}:scenecut=0"}
        for number in range(count):
            frame = av.VideoFrame.from_ndarray(np.full((240, 320), 16 + 10 * number, np.uint8), format="gray")
            frame.pts, frame.time_base = number, Fraction(1, 30)
            container.mux(stream.encode(frame.reformat(format="yuv420p")))
        container.mux(stream.encode(None))
    with av.open(str(path)) as container:
        return [
            stamped(packet, 10 + number / 30) for number, packet in enumerate(container.demux(video=0)) if packet.size
        ]


def brightness(packets: list[Any]) -> list[int]:
    """Of the pictures that somebody sees who knows nothing but these packets."""
    decoder = cast(Any, av.CodecContext.create("h264", "r"))
    data = (*map(bytes, packets), None)
    frames = [frame for one in data for frame in decoder.decode(None if one is None else av.Packet(one))]
    return [round(frame.to_ndarray(format="gray").mean()) for frame in frames]


def of_codec(name: str, kind: str = "video") -> Any:
    """A packet as a demuxer gives it; PyAV lets nobody make such a one without a file."""
    context = SimpleNamespace(name=name, type=kind, extradata=None, has_b_frames=False)
    return SimpleNamespace(
        stream=SimpleNamespace(codec_context=context), is_keyframe=True, size=100, pts=0, time_base=VIDEO_TIME_BASE
    )


def test_bare_packets_are_h264_and_their_key_frames_are_found() -> None:
    source, packets = PassedPackets("front"), h264(21)
    for packet in packets:
        source.taken(packet)
    assert source.state.sendable_as == "H264"
    assert [number for number, packet in enumerate(packets) if packet.is_keyframe] == [0, 10, 20]


@pytest.mark.parametrize(("name", "expected"), [("vp8", "VP8"), ("hevc", None), ("mjpeg", None)])
def test_the_streams_codec_says_whether_packets_can_be_sent(name: str, expected: str | None) -> None:
    source = PassedPackets("front")
    source.taken(of_codec(name))
    assert source.state.sendable_as == expected


def test_the_bit_rate_becomes_known_within_two_seconds() -> None:
    source, packets = PassedPackets("front"), h264(90)
    for packet in packets:
        source.taken(packet)
    true_bps = sum(packet.size for packet in packets) * 8 / 3
    assert source.state.bitrate_bps == pytest.approx(true_bps, rel=0.5)


def test_pictures_begin_at_a_key_frame_and_keep_their_capture_times() -> None:
    source, packets = PassedPackets("front"), h264(21)
    for packet in packets:
        source.taken(packet)
    assert [source.pictures(packet) for packet in packets[1:10]] == [[]] * 9
    pictures = [picture for packet in packets[10:] for picture in source.pictures(packet)]
    assert [picture.pts for picture in pictures] == [packet.pts for packet in packets[10:]]
    assert pictures[0].format.name == "yuv420p"
    source.rest()
    assert source.pictures(packets[11]) == [], "it starts over at a key frame"


def test_damage_costs_pictures_until_the_next_key_frame_only() -> None:
    source, packets = PassedPackets("front"), h264(21)
    for packet in packets:
        source.taken(packet)
    broken = stamped(av.Packet(b"\x00\x00\x00\x01\x65garbage"), 11.0)
    assert source.pictures(packets[0])
    source.pictures(broken)
    assert source.pictures(packets[20])


def test_a_codec_that_nothing_here_decodes_is_hopeless_for_those_without_it(caplog: pytest.LogCaptureFixture) -> None:
    source, packet = PassedPackets("front"), of_codec("no_such_codec")
    source.taken(packet)
    assert source.pictures(packet) == []
    assert not source.state.is_decodable
    shape = SourceShape(packets=source.state)
    assert shape.is_hopeless("VP8")
    assert not SourceShape(packets=SourceState("H264", is_decodable=False)).is_hopeless("H264")
    assert any("no_such_codec" in record.message for record in caplog.records)


def test_a_viewer_of_the_sources_codec_gets_its_packets_and_cheaper_rungs_below() -> None:
    state = SourceState("H264", bitrate_bps=2_000_000)
    shape = SourceShape((1280, 720), state)
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


@pytest.mark.parametrize("name", ["clip.mp4", "clip.mkv", "clip.ts", "clip.h264"])
def test_h264_of_a_file_is_sent_with_start_codes_and_parameter_sets(tmp_path: Path, name: str) -> None:
    source, packets = PassedPackets("front"), recorded(tmp_path / name)
    before = [bytes(packet) for packet in packets]
    sent = [source.taken(packet) for packet in packets]
    assert source.state.sendable_as == "H264"
    assert [packet.is_keyframe for packet in sent] == [number % 4 == 0 for number in range(12)]
    assert [packet.pts for packet in sent] == [packet.pts for packet in packets]
    assert brightness(sent) == sorted(brightness(sent))
    assert len(brightness(sent)) == 12
    assert len(brightness(sent[4:])) == 8, "whoever joins at a key frame"
    assert len([picture for packet in sent for picture in source.pictures(packet)]) == 12
    assert [bytes(packet) for packet in packets] == before, "the handler may go on using them"


def test_a_recording_that_begins_anew_and_another_one_are_recognised(tmp_path: Path) -> None:
    source = PassedPackets("front")
    for packets in (recorded(tmp_path / "a.mp4"), recorded(tmp_path / "a.mp4"), h264(4), recorded(tmp_path / "b.mkv")):
        assert len(brightness([source.taken(packet) for packet in packets])) == len(packets)


def test_pictures_that_refer_to_later_ones_are_not_sent_as_they_are_but_decoded_in_order(tmp_path: Path) -> None:
    source, packets = PassedPackets("front"), recorded(tmp_path / "clip.mp4", b_frames=2)
    pictures = [picture for packet in packets for picture in source.pictures(source.taken(packet))]
    assert source.state.sendable_as is None
    shown = [round(picture.to_ndarray(format="gray").mean()) for picture in pictures]
    assert len(shown) >= 9
    assert shown == sorted(shown)


@pytest.mark.parametrize("name", ["libvpx", "mjpeg", "mp4"])
def test_bare_packets_that_are_no_h264_with_start_codes_are_refused_with_the_cure(tmp_path: Path, name: str) -> None:
    if name == "mp4":
        packets = [stamped(av.Packet(bytes(one)), 10.0) for one in recorded(tmp_path / "clip.mp4")]
    else:
        packets = encoded(name, 3)
    source = PassedPackets("front")
    for packet in packets[:2]:
        with pytest.raises(TypeError, match=r"without a stream.* start code .* set packet_codec"):
            source.taken(packet)
    source.taken(h264(1)[0])
    assert source.state.sendable_as == "H264"


def test_bare_packets_of_the_declared_codec_are_passed_on() -> None:
    source, packets = PassedPackets("front", "vp8"), encoded("libvpx", 21)
    sent = [source.taken(packet) for packet in packets]
    assert source.state.sendable_as == "VP8"
    assert [number for number, packet in enumerate(sent) if packet.is_keyframe] == [0, 10, 20]
    assert len([picture for packet in sent for picture in source.pictures(packet)]) == 21


def test_a_packet_of_sound_is_no_picture() -> None:
    with pytest.raises(TypeError, match=r"audio stream is no picture; take those of demux\(video=0\)"):
        PassedPackets("front").taken(of_codec("aac", "audio"))


def test_who_waits_for_a_key_frame_in_vain_is_told_why_once(caplog: pytest.LogCaptureFixture) -> None:
    source, packets = PassedPackets("front"), h264(2, key_every=1000)
    for _ in range(4):
        source.taken(packets[0])
        for _ in range(200):
            source.taken(packets[1])
    assert [message for message in caplog.messages if "no key frame" in message] == caplog.messages
    assert len(caplog.messages) == 1


def test_packets_that_can_not_be_decoded_are_told_with_the_cause_once(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "mosaic_core")
    source = PassedPackets("front", "vp8")
    for number in range(400):
        source.pictures(source.taken(stamped(av.Packet(b"\x00garbage"), 10 + number / 30)))
    (message,) = caplog.messages
    assert "no picture in 150 packets of vp8: " in message
    assert "nvalid data" in message


def fed(source: PassedPackets, bitrate_bps: int, seconds: float, at_s: float) -> list[bool]:
    """30 packets per second from ``at_s`` on, and whether the source was within its ceiling at each."""
    found = []
    for number in range(round(seconds * 30)):
        data = b"\x00\x00\x00\x01\x41" + bytes(bitrate_bps // 240 - 5)
        source.taken(stamped(av.Packet(data), at_s + number / 30))
        found.append(source.state.is_within_ceiling)
    return found


def test_a_source_above_the_ceiling_is_never_taken_for_one_below_it() -> None:
    source = PassedPackets("front", ceiling_bps=1_000_000)
    assert not any(fed(source, 1_100_000, 6, 10)), "nor before its rate is known"
    assert not any(fed(source, 900_000, 6, 16)), "nor when it varies around it"
    assert fed(source, 500_000, 6, 22)[-1]
    assert fed(source, 900_000, 6, 28)[-1]
    assert not fed(source, 1_100_000, 3, 34)[-1]
    assert all(fed(PassedPackets("front"), 9_000_000, 3, 10)), "no ceiling is set"


def test_a_source_just_below_the_ceiling_is_known_to_be_so_after_a_second_though_it_ends_in_a_key_frame() -> None:
    source = PassedPackets("front", ceiling_bps=1_000_000)
    for number in range(31):
        size = 40_000 if number % 30 == 0 else 2_500  # 900 kbit/s
        data = b"\x00\x00\x00\x01\x65" + bytes(size)
        source.taken(stamped(av.Packet(data), 10 + number / 30))
    assert source.state.is_within_ceiling


def test_a_ceiling_holds_for_packets_that_came_encoded() -> None:
    encoding = EncodingParams(max_bitrate_bps=500_000)
    above = SourceState("H264", bitrate_bps=4_000_000, is_within_ceiling=False)
    shape = SourceShape((1280, 720), above)
    options = options_of("H264", shape, encoding)
    assert options
    assert PASSED_ON not in dict(options)
    assert all(rung.ceiling_bps <= 500_000 for _, rung in options)
    assert limits_bps(shape, encoding) == (150_000, 500_000)
    assert dict(options_of("H264", shape, encoding, is_local=True))[PASSED_ON], "a recorder is no operator"
    assert limits_bps(shape, encoding, is_local=True)[1] == 8_000_000


def test_under_a_ceiling_all_that_the_source_sends_is_in_the_budget_before_copies_are() -> None:
    shape = SourceShape((1280, 720), SourceState("H264", bitrate_bps=800_000))
    encoding = EncodingParams(max_bitrate_bps=1_000_000)
    assert dict(options_of("H264", shape, encoding))[PASSED_ON].floor_bps == 800_000
    assert limits_bps(shape, encoding) == (150_000, 1_000_000)


SEEN = SourceShape(packets=SourceState("H264", bitrate_bps=800_000))
TOO_MUCH = SourceShape(packets=SourceState("H264", bitrate_bps=800_000, is_within_ceiling=False))


@pytest.mark.parametrize(
    ("encoding", "shape", "declared", "found", "first"),
    [
        ({}, SourceShape(), None, "VP8", "VP8"),
        ({}, SourceShape(), None, "H264", "H264"),
        ({}, SourceShape(), "h264", "VP8", "H264"),
        ({}, SourceShape(), "vp8", "H264", "VP8"),
        ({}, SEEN, None, "VP8", "H264"),
        ({}, TOO_MUCH, None, "VP8", "VP8"),
        ({"codec": "vp8"}, SEEN, "h264", "H264", "VP8"),
        ({"codec": "h264"}, SourceShape(), "vp8", "VP8", "H264"),
        ({"encoder": "h264_nvenc"}, SourceShape(), "vp8", "VP8", "H264"),
        ({"encoder": "libvpx"}, SEEN, None, "H264", "VP8"),
    ],
)
def test_the_first_codec_is_the_wish_else_the_sources_else_the_machines(
    encoding: Any, shape: SourceShape, declared: Any, found: Any, first: str
) -> None:
    codecs = codecs_of(shape, EncodingParams(**encoding), declared, found)
    assert codecs[0] == first
    assert set(codecs) == {"VP8", "H264"}
