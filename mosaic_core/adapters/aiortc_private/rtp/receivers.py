"""Receivers of RTP: the timestamp that a picture came with, the receiver that a repeat is for, how many sources there
may be, and pictures without the wait that aiortc adds where packets are lost.

Its jitter buffer hands out a picture when the next one begins, a frame's time late, and one for each packet that comes,
so that a queue once there stays; it waits for a lost packet until 512 more have come, which at a low rate is seconds;
and it asks for one again only when another is missing.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from aiortc import RTCPeerConnection, RTCRtpReceiver
from aiortc.jitterbuffer import JitterBuffer, JitterFrame
from aiortc.rtcdtlstransport import RtpReceiver, RtpRouter
from aiortc.rtp import RtpPacket
from aiortc.sdp import SessionDescription
from aiortc.utils import uint16_add, uint16_gt

from mosaic_core.machines.media.capture_clock import RTP_MODULUS
from mosaic_core.runtime.timing.background_tasks import BackgroundTasks


def rtp_timestamp_of(receiver: RTCRtpReceiver, frame: Any) -> int | None:
    """The timestamp on the wire. aiortc's receiver counts ``pts`` from the first picture that it got."""
    mapper: Any = vars(receiver)["_RTCRtpReceiver__timestamp_mapper"]
    origin = mapper._origin
    return None if origin is None or frame.pts is None else int(frame.pts + origin) % RTP_MODULUS


def route_repeats(pc: RTCPeerConnection) -> None:
    """Tell ``pc`` which receiver each stream of repeats in the remote description is for (RFC 5576 and RFC 4588,
    section 8.8): aiortc knows it by its payload type alone, and that is the same for all cameras of a connection."""
    lines = {transceiver.mid: transceiver for transceiver in pc.getTransceivers()}
    for media in SessionDescription.parse(pc.remoteDescription.sdp).media:
        line = lines.get(media.rtp.muxId)
        for group in media.ssrc_group:
            if line is not None and group.semantic == "FID" and len(group.items) == 2:
                transport: Any = line.receiver.transport
                transport._rtp_router.ssrc_table[group.items[1]] = line.receiver


MAX_SOURCES = 256
"""Streams of one connection, repeats included; a robot with sixty cameras sends half as many."""


def bound_sources(pc: RTCPeerConnection) -> None:
    """From now on: packets of ever more sources are left out. aiortc keeps what it counts of each to the end."""
    for transport in {line.receiver.transport for line in pc.getTransceivers()}:
        _bound_sources(transport._rtp_router)


def _bound_sources(router: RtpRouter) -> None:
    route = router.route_rtp

    def route_unless_too_many(packet: RtpPacket) -> RtpReceiver | None:
        known = router.ssrc_table
        return route(packet) if packet.ssrc in known or len(known) < MAX_SOURCES else None

    router.route_rtp = route_unless_too_many  # type: ignore[method-assign]


PATIENCE_S = 0.5
"""For a lost packet; then the picture is given up, and a key picture is asked for."""
ASK_AGAIN_S = 0.12
"""Robots of ours do not repeat a packet that is on its way already."""
CAPACITY = 512
HALF = 1 << 15
"""Of the sequence numbers: what is further ahead is behind."""


def be_prompt(receiver: RTCRtpReceiver) -> None:
    """Before the first packet."""
    names: Any = vars(receiver)
    names["_RTCRtpReceiver__jitter_buffer"] = _PromptBuffer(receiver)


class Gaps:
    """Notes since when the oldest packet is missing, and decides what to do about it. Times in seconds by any clock."""

    def __init__(self) -> None:
        self._since_s: float | None = None
        self._asked_at_s = 0.0

    def waits(self, is_gap: bool, now_s: float) -> tuple[bool, bool]:
        """Whether to ask again, and whether to give up."""
        if not is_gap:
            self._since_s = None
            return False, False
        if self._since_s is None:
            self._since_s = self._asked_at_s = now_s
        if now_s - self._since_s >= PATIENCE_S:
            self._since_s = None
            return False, True
        if now_s - self._asked_at_s >= ASK_AGAIN_S:
            self._asked_at_s = now_s
            return True, False
        return False, False


def begins_key_picture(mime_type: str, data: bytes) -> bool:
    """``data``: what the first packet of a picture carries, as aiortc gives it to the decoder."""
    match mime_type.lower():
        case "video/vp8":
            return bool(data) and not data[0] & 1  # RFC 6386, section 9.1
        case "video/h264":
            start = b"\0\0\0\1"
            return data.startswith(start) and len(data) > len(start) and data[len(start)] & 0x1F in (5, 7)
        case _:
            return False


class _PromptBuffer(JitterBuffer):
    def __init__(self, receiver: RTCRtpReceiver, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__(capacity=CAPACITY, is_video=True)
        self._receiver: Any = receiver
        self._names: Any = vars(receiver)
        self._clock = clock
        self._gaps = Gaps()
        self._asking = BackgroundTasks()

    def add(self, packet: RtpPacket) -> tuple[bool, JitterFrame | None]:
        wants_key, frame = super().add(packet)
        has_gap = self._has_gap(packet)
        if has_gap and self._skip(self._is_key):  # nobody needs what is before it
            has_gap = self._has_gap(packet)
        asks, gives_up = self._gaps.waits(has_gap, self._clock())
        if asks:
            self._ask_again(packet.ssrc)
        if gives_up and self._skip(lambda _: True):
            wants_key = True
        return wants_key, self._newest(packet, frame)

    def _remove_frame(self, sequence_number: int) -> JitterFrame | None:
        """The first picture if it is whole: its last packet is marked (RFC 7741, RFC 6184), or the next has begun."""
        packets: list[RtpPacket] = []
        for count in range(self.capacity):
            packet = self._packet(count)
            if packet is None:
                return None
            if packets and packet.timestamp != packets[0].timestamp:
                return self._taken(packets)
            packets.append(packet)
            if packet.marker:
                return self._taken(packets)
        return None

    def _taken(self, packets: list[RtpPacket]) -> JitterFrame:
        self.remove(len(packets))
        return JitterFrame(data=b"".join(_payload(packet) for packet in packets), timestamp=packets[0].timestamp)

    def _newest(self, packet: RtpPacket, frame: JitterFrame | None) -> JitterFrame | None:
        """All pictures that are whole now go to the decoder, the last one as aiortc does it itself."""
        following = self._remove_frame(packet.sequence_number)
        while following is not None:
            if frame is not None:
                self._decode(packet, frame)
            frame, following = following, self._remove_frame(packet.sequence_number)
        return frame

    def _decode(self, packet: RtpPacket, frame: JitterFrame) -> None:
        names = self._names
        codec = names["_RTCRtpReceiver__codecs"].get(packet.payload_type)
        if codec is not None and names["_RTCRtpReceiver__decoder_thread"] is not None:
            frame.timestamp = names["_RTCRtpReceiver__timestamp_mapper"].map(frame.timestamp)
            names["_RTCRtpReceiver__decoder_queue"].put((codec, frame))

    def _has_gap(self, packet: RtpPacket) -> bool:
        """Something is missing before what has come."""
        ahead = uint16_add(packet.sequence_number, -self._first)
        return ahead < HALF and any(self._packet(count) is None for count in range(min(ahead, self.capacity)))

    def _skip(self, is_wanted: Callable[[RtpPacket], bool]) -> bool:
        """To the first such picture after the gap; it begins behind a packet that ends one."""
        gap = next((count for count in range(self.capacity) if self._packet(count) is None), self.capacity)
        for count in range(gap + 1, self.capacity):
            before, packet = self._packet(count - 1), self._packet(count)
            if before is not None and before.marker and packet is not None and is_wanted(packet):
                self.remove(count)
                return True
        return False

    def _is_key(self, packet: RtpPacket) -> bool:
        codec = self._names["_RTCRtpReceiver__codecs"].get(packet.payload_type)
        return codec is not None and begins_key_picture(codec.mimeType, _payload(packet))

    @property
    def _first(self) -> int:
        """The number of the packet that is next for the decoder."""
        return self._origin or 0

    def _packet(self, count: int) -> RtpPacket | None:
        found: RtpPacket | None = self._packets[(self._first + count) % self.capacity]
        return found

    def _ask_again(self, ssrc: int) -> None:
        missing = self._names["_RTCRtpReceiver__nack_generator"].missing
        lost = sorted(number for number in missing if not uint16_gt(self._first, number))
        if lost:
            self._asking.start(self._receiver._send_rtcp_nack(ssrc, lost))


def _payload(packet: RtpPacket) -> bytes:
    """Without the codec's descriptor: aiortc's receiver has put it there."""
    data: bytes = packet._data  # type: ignore[attr-defined]
    return data
