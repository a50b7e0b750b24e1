"""A media track that takes encoded pictures from the runtime and gives back what the operator's side reports."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import av
from aiortc import RTCRtpSender
from aiortc.mediastreams import MediaStreamError, MediaStreamTrack

from mosaic_core.adapters.aiortc_private.rtp.paced_transport import PacedTransport
from mosaic_core.adapters.aiortc_private.rtp.packet_arrivals import PacketNumbers, sequence_number_of
from mosaic_core.adapters.aiortc_private.rtp.senders import RtpOriginLearner, SenderFeedback, ssrc_of
from mosaic_core.adapters.video.picture_clock import VIDEO_TIME_BASE
from mosaic_core.machines.congestion.arrival_report import ArrivalReport
from mosaic_core.machines.congestion.missing_packets import MissingPackets
from mosaic_core.runtime.transport.media_transport import PictureFeed
from mosaic_core.runtime.transport.peer_congestion import PeerCongestion


class FeedTrack(MediaStreamTrack):
    """Sends what its feed gives. Its ``id`` is the connector's label, so that ``msid`` names it."""

    def __init__(self, label: str, feed: PictureFeed) -> None:
        super().__init__()
        self._label = label
        self._feed = feed

    @property
    def id(self) -> str:
        return self._label

    async def recv(self) -> Any:
        """Wait for the next packet. The sender asks again only after it has sent the previous one."""
        if self.readyState != "live":
            raise MediaStreamError
        return await self._feed.next()


class VideoTrack(FeedTrack):
    """Sends the pictures of one camera to one operator.

    ``on_origin(rtp_origin)`` is called once, after the first picture has left. ``has_arrivals``: the operator's side
    reports when each packet arrived. ``connection``: whose budget it shares with the operator's other cameras.
    """

    kind = "video"

    def __init__(
        self,
        label: str,
        feed: PictureFeed,
        sender: RTCRtpSender,
        on_origin: Callable[[int], None],
        *,
        has_arrivals: bool = False,
        connection: PeerCongestion | None = None,
    ) -> None:
        super().__init__(label, feed)
        self._connection = connection or PeerCongestion()
        feed.send_over(self._connection)
        self._origin: RtpOriginLearner | None = RtpOriginLearner(sender)
        self._ssrc = ssrc_of(sender)
        self._missing = MissingPackets()
        self._numbers = PacketNumbers(sender, self._connection.reported, self._arrived) if has_arrivals else None
        self._pacing = PacedTransport(sender, feed, self._left)
        self._feedback = SenderFeedback(sender, feed, self._pacing.copy_later)
        self._on_origin = on_origin
        self._last_pts = -1

    async def recv(self) -> Any:
        self._learn_origin()
        packet: av.Packet[Any] = await super().recv()
        if (packet.pts or 0) <= self._last_pts:
            packet = _later(packet, self._last_pts + 1)
        self._last_pts = packet.pts or 0
        return packet

    def _left(self, data: bytes) -> None:
        number = self._numbers.take() if self._numbers is not None else None
        if number is not None:
            self._connection.packet_left(number, len(data))
            self._missing.sent(number, sequence_number_of(data, self._ssrc))

    def _arrived(self, report: ArrivalReport) -> None:
        for sequence_number in self._missing.reported(report):
            self._pacing.copy_later([sequence_number] * self._feed.repeats(sequence_number), after_s=0.0)

    def _learn_origin(self) -> None:
        if self._origin is None or self._last_pts < 0:
            return
        origin = self._origin.learn(self._last_pts)
        if origin is not None:
            self._origin = None
            self._on_origin(origin)


def _later(packet: av.Packet[Any], pts: int) -> av.Packet[Any]:
    """The same picture with another time stamp: two rungs may have encoded the same moment, and pictures of one RTP
    time would be taken for one. Shared packets are never changed."""
    moved: av.Packet[Any] = av.Packet(bytes(packet))
    moved.pts = moved.dts = pts
    moved.time_base = VIDEO_TIME_BASE
    moved.is_keyframe = packet.is_keyframe
    return moved
