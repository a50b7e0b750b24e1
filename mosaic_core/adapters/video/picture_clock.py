"""The time of a picture on the wire: capture times of the robot's monotonic clock as 90 kHz timestamps."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import av

VIDEO_TIME_BASE = Fraction(1, 90_000)
_TICKS_PER_100_US = 9
"""Capture times are kept to 100 µs: such a time is a whole number of ticks at 90 kHz *and* of microseconds, the time
base of PyAV's encoders. Any finer, and their rounding would move RTP timestamps by one tick."""


def pts_of(captured_at_s: float) -> int:
    """The 90 kHz timestamp of a moment on the robot's monotonic clock."""
    return round(captured_at_s * 10_000) * _TICKS_PER_100_US


def stamped(packet: av.Packet[Any], captured_at_s: float) -> av.Packet[Any]:
    """The packet itself, with the time of its picture."""
    packet.pts = packet.dts = pts_of(captured_at_s)
    packet.time_base = VIDEO_TIME_BASE
    return packet
