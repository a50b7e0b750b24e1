"""Reads and watches one RTP sender of aiortc: its stream's name, its RTP origin, and what the operator reports about
it.

aiortc turns a request for a key frame into a private flag and a bandwidth estimate into a property of its own encoder;
neither reaches a track that brings packets.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from aiortc import RTCRtpSender
from aiortc.rtp import (
    RTCP_PSFB_APP,
    RTCP_RTPFB_NACK,
    AnyRtcpPacket,
    RtcpPsfbPacket,
    RtcpReceiverInfo,
    RtcpRrPacket,
    RtcpRtpfbPacket,
    RtcpSrPacket,
    unpack_remb_fci,
)

from mosaic_core.machines.congestion.feedback import BandwidthEstimate, PacketsMissing, PictureLost, ReceiverReport
from mosaic_core.machines.media.capture_clock import RTP_MODULUS
from mosaic_core.runtime.transport.media_transport import PictureFeed


def name_stream(sender: RTCRtpSender, label: str) -> None:
    """Make the sender's stream id the label: browsers read it as ``streams[0].id``."""
    sender._stream_id = label


def ssrc_of(sender: RTCRtpSender) -> int:
    return int(sender._ssrc)


class RtpOriginLearner:
    """Learns what aiortc adds to a picture's pts, from the timestamp of the last packet that the sender sent."""

    def __init__(self, sender: RTCRtpSender) -> None:
        self._sender = sender
        self._before = self._timestamp()

    def learn(self, last_pts: int) -> int | None:
        """The origin, if the picture with ``last_pts`` has left by now."""
        timestamp = self._timestamp()
        if timestamp == self._before:
            return None
        return (timestamp - last_pts) % RTP_MODULUS

    def _timestamp(self) -> int:
        return int(self._sender._RTCRtpSender__rtp_timestamp)  # type: ignore[attr-defined]


class SenderFeedback:
    """Tells a feed what the receiving side says about its sender, after aiortc has seen to it itself; a lost packet is
    sent again as often as the feed says, the second time by ``copy_later``."""

    def __init__(self, sender: RTCRtpSender, feed: PictureFeed, copy_later: Callable[[list[int]], None]) -> None:
        self._sender = sender
        self._feed = feed
        self._copy_later = copy_later
        self._repeat = sender._retransmit
        sender._retransmit = self._repeat_if_wise  # type: ignore[method-assign]
        self._handle = sender._handle_rtcp_packet
        sender._handle_rtcp_packet = self._handle_and_tell  # type: ignore[method-assign]
        sender._send_keyframe = lambda: feed.heard(PictureLost())  # type: ignore[method-assign]

    async def _handle_and_tell(self, packet: AnyRtcpPacket) -> None:
        await self._handle(packet)
        if isinstance(packet, RtcpRrPacket | RtcpSrPacket):
            for report in packet.reports:
                if report.ssrc == self._sender._ssrc:
                    self._feed.heard(
                        ReceiverReport(report.packets_lost, report.highest_sequence, self._round_trip_s(report))
                    )
        elif isinstance(packet, RtcpRtpfbPacket) and packet.fmt == RTCP_RTPFB_NACK:
            self._feed.heard(PacketsMissing(len(packet.lost)))
        elif isinstance(packet, RtcpPsfbPacket) and packet.fmt == RTCP_PSFB_APP:
            self._hear_estimate(packet.fci)

    async def _repeat_if_wise(self, sequence_number: int) -> None:
        times = self._feed.repeats(sequence_number)
        if times > 0:
            await self._repeat(sequence_number)
        if times > 1:
            self._copy_later([sequence_number])

    def _hear_estimate(self, fci: bytes) -> None:
        try:
            bitrate_bps, ssrcs = unpack_remb_fci(fci)
        except ValueError:
            return  # some other application's message
        if self._sender._ssrc in ssrcs:
            self._feed.heard(BandwidthEstimate(bitrate_bps))

    def _round_trip_s(self, report: RtcpReceiverInfo) -> float | None:
        """As aiortc computes it, but without its smoothing, which hides a queue for ten seconds."""
        sender: Any = self._sender
        if not report.dlsr or report.lsr != sender._RTCRtpSender__lsr:
            return None
        return max(0.0, time.time() - float(sender._RTCRtpSender__lsr_time) - report.dlsr / 65536)
