"""Finds the receiver of a repeat where there are several: aiortc knows it by its payload type alone, and that is the
same for all cameras of a connection."""

from __future__ import annotations

from typing import Any

from aiortc import RTCPeerConnection
from aiortc.sdp import SessionDescription


def route_repeats(pc: RTCPeerConnection) -> None:
    """Of every line that the remote description names a stream of repeats for (RFC 5576 and RFC 4588, section 8.8)."""
    lines = {transceiver.mid: transceiver for transceiver in pc.getTransceivers()}
    for media in SessionDescription.parse(pc.remoteDescription.sdp).media:
        line = lines.get(media.rtp.muxId)
        for group in media.ssrc_group:
            if line is not None and group.semantic == "FID" and len(group.items) == 2:
                transport: Any = line.receiver.transport
                transport._rtp_router.ssrc_table[group.items[1]] = line.receiver
