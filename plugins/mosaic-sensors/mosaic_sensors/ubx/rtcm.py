"""Checks corrections before a receiver gets them. Pure.

An RTCM 3 frame is D3, ten bits of length, the payload and a CRC-24Q. Nothing else may pass: UBX on the same line would
set the receiver up anew, or erase it.
"""

from __future__ import annotations

from pyrtcm import calc_crc24q  # type: ignore[import-untyped]

PREAMBLE = 0xD3
_HEADER, _CRC = 3, 3


def checked_frames(data: bytes) -> bytes:
    """``data`` itself, if it is whole RTCM 3 frames and nothing else. Raises :class:`ValueError`."""
    at = 0
    while at < len(data):
        length = int.from_bytes(data[at + 1 : at + _HEADER], "big")
        frame = data[at : at + _HEADER + length + _CRC]
        if frame[0] != PREAMBLE or length > 0x3FF:
            raise ValueError(f"byte {at} begins no RTCM 3 frame")
        if len(frame) < _HEADER + length + _CRC:
            raise ValueError(f"the frame at byte {at} is cut off: send whole frames")
        if calc_crc24q(frame) != 0:
            raise ValueError(f"the frame at byte {at} has a wrong checksum")
        at += len(frame)
    if not data:
        raise ValueError("nothing in it")
    return data


def framed(payload: bytes) -> bytes:
    """``payload`` as an RTCM 3 frame."""
    body = bytes([PREAMBLE]) + len(payload).to_bytes(2, "big") + payload
    return body + int(calc_crc24q(body)).to_bytes(3, "big")
