"""Receivers of RTP: the timestamp that a picture came with, and the receiver that a repeat is for."""

from __future__ import annotations

from typing import Any

from aiortc import RTCPeerConnection, RTCRtpReceiver
from aiortc.sdp import SessionDescription

from mosaic_core.machines.media.capture_clock import RTP_MODULUS


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
