"""A track passes packets on, keeps time going forward, and learns where RTP time begins."""

from __future__ import annotations

import time
from types import SimpleNamespace
from typing import Any, cast

import av
import pytest
from aiortc import RTCRtpSender
from aiortc.mediastreams import MediaStreamError
from aiortc.rtp import RTCP_PSFB_PLI, RtcpPsfbPacket, RtcpReceiverInfo, RtcpRrPacket, RtcpRtpfbPacket, pack_remb_fci

from mosaic_core.adapters.video.picture_clock import pts_of, stamped
from mosaic_core.adapters.video.video_track import VideoTrack
from mosaic_core.laboratory.joining import until
from mosaic_core.machines.congestion.feedback import BandwidthEstimate, PacketsMissing, PictureLost, ReceiverReport

SSRC = 4711


class Feed:
    codec_order = ("video/VP8",)

    def __init__(self, *times_s: float) -> None:
        self.packets = [stamped(av.Packet(b"\x00\x00\x01\x65"), time_s) for time_s in times_s]
        self.reports: list[Any] = []

    async def next(self) -> Any:
        return self.packets.pop(0)

    def codec_agreed(self, mime_type: str) -> None: ...

    def send_over(self, connection: Any) -> None: ...

    async def paced(self, size_bytes: int) -> None: ...

    def repeats(self, sequence_number: int) -> int:
        return 2 if sequence_number == 8 else 1 - sequence_number % 2

    def wants_copy(self, sequence_number: int, size_bytes: int) -> bool:
        return False

    def heard(self, feedback: Any) -> None:
        self.reports.append(feedback)


class Transport:
    async def _send_rtp(self, data: bytes) -> None: ...


class Sender(SimpleNamespace):
    """What a track touches of an RTCRtpSender."""

    def __init__(self, timestamp: int = 0) -> None:
        super().__init__(_RTCRtpSender__rtp_timestamp=timestamp, _ssrc=SSRC)
        self._RTCRtpSender__lsr, self._RTCRtpSender__lsr_time = 4, time.time() - 1.0
        self.handled: list[Any] = []
        self.transport: Any = Transport()
        self.repeated: list[int] = []

    async def _handle_rtcp_packet(self, packet: Any) -> None:
        self.handled.append(packet)
        if getattr(packet, "fmt", None) == RTCP_PSFB_PLI and isinstance(packet, RtcpPsfbPacket):
            self._send_keyframe()

    def setTransport(self, transport: Any) -> None:
        self.transport = transport

    async def _retransmit(self, sequence_number: int) -> None:
        self.repeated.append(sequence_number)

    def _send_keyframe(self) -> None:
        raise AssertionError("aiortc's own flag is read by nobody")


def track_of(feed: Feed, sender: Any, origins: list[int] | None = None) -> VideoTrack:
    return VideoTrack("front", feed, cast(RTCRtpSender, sender), (origins if origins is not None else []).append)


async def test_its_id_is_the_label() -> None:
    track = track_of(Feed(), Sender())
    assert (track.id, track.kind) == ("front", "video")


async def test_a_packet_that_is_not_newer_is_sent_a_tick_later_and_stays_as_it_is_for_others() -> None:
    feed = Feed(2.0, 2.0, 1.0, 3.0)
    shared = list(feed.packets)
    track = track_of(feed, Sender())
    sent = [await track.recv() for _ in range(4)]
    assert [packet.pts for packet in sent] == [pts_of(2.0), pts_of(2.0) + 1, pts_of(2.0) + 2, pts_of(3.0)]
    assert [packet.pts for packet in shared] == [pts_of(2.0), pts_of(2.0), pts_of(1.0), pts_of(3.0)]
    assert {bytes(packet) for packet in sent} == {b"\x00\x00\x01\x65"}


async def test_the_origin_is_told_once_when_the_first_picture_has_left() -> None:
    origins: list[int] = []
    sender = Sender()
    track = track_of(Feed(1.0, 2.0, 3.0, 4.0), sender, origins)
    await track.recv()
    await track.recv()  # the sender was not enabled: nothing has left
    assert origins == []
    sender._RTCRtpSender__rtp_timestamp = (pts_of(2.0) + 4_294_000_000) % (1 << 32)
    await track.recv()
    await track.recv()
    assert origins == [4_294_000_000]


async def test_a_stopped_track_ends() -> None:
    track = track_of(Feed(1.0), Sender())
    track.stop()
    with pytest.raises(MediaStreamError):
        await track.recv()


async def test_the_feed_decides_which_packets_are_sent_again() -> None:
    sender = Sender()
    track_of(Feed(), sender)
    for sequence_number in range(4):
        await sender._retransmit(sequence_number)
    assert sender.repeated == [0, 2]
    await sender._retransmit(8)  # once more, a little later
    await until(lambda: len(sender.repeated) >= 4)
    assert sender.repeated == [0, 2, 8, 8]


async def test_what_the_operator_reports_reaches_the_feed_and_still_aiortc() -> None:
    feed, sender = Feed(), Sender()
    track_of(feed, sender)
    report = RtcpReceiverInfo(SSRC, 64, 11, 222, 3, 4, 65536 // 2)
    other = RtcpReceiverInfo(SSRC + 1, 255, 1, 2, 3, 4, 5)
    packets: list[Any] = [
        RtcpRrPacket(ssrc=1, reports=[other, report]),
        RtcpRtpfbPacket(fmt=1, ssrc=1, media_ssrc=SSRC, lost=[7, 8, 9]),
        RtcpPsfbPacket(fmt=RTCP_PSFB_PLI, ssrc=1, media_ssrc=SSRC),
        RtcpPsfbPacket(fmt=15, ssrc=1, media_ssrc=0, fci=pack_remb_fci(500_000, [SSRC])),
        RtcpPsfbPacket(fmt=15, ssrc=1, media_ssrc=0, fci=pack_remb_fci(100_000, [SSRC + 1])),
        RtcpPsfbPacket(fmt=15, ssrc=1, media_ssrc=0, fci=b"something else"),
    ]
    for packet in packets:
        await sender._handle_rtcp_packet(packet)
    assert feed.reports[0] == ReceiverReport(11, 222, pytest.approx(0.5, abs=0.3))
    assert feed.reports[1:3] == [PacketsMissing(3), PictureLost()]
    assert isinstance(feed.reports[3], BandwidthEstimate)
    assert abs(feed.reports[3].bitrate_bps - 500_000) < 1000
    assert len(feed.reports) == 4
    assert sender.handled == packets
