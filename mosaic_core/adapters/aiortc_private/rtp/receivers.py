"""What aiortc knows of a received picture and keeps to itself: the RTP timestamp that it came with."""

from __future__ import annotations

from typing import Any

from aiortc import RTCRtpReceiver

RTP_MODULUS = 1 << 32


def rtp_timestamp_of(receiver: RTCRtpReceiver, frame: Any) -> int | None:
    """The timestamp on the wire. aiortc's receiver counts ``pts`` from the first picture that it got."""
    mapper: Any = vars(receiver)["_RTCRtpReceiver__timestamp_mapper"]
    origin = mapper._origin
    return None if origin is None or frame.pts is None else int(frame.pts + origin) % RTP_MODULUS
