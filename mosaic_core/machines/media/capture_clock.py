"""Computes when a picture was captured, on the robot's clock, from its RTP timestamp and the origin that the robot
announced.

An RTP timestamp counts 90 000 a second and wraps every 13 hours; the capture is taken to be the one nearest to now.
"""

from __future__ import annotations

RTP_MODULUS = 1 << 32
_US_PER_9_TICKS = 100


def capture_us(rtp_timestamp: int, rtp_origin: int, robot_now_us: int) -> int:
    """Microseconds of the robot's monotonic clock. ``robot_now_us`` may be wrong by hours."""
    ticks = (rtp_timestamp - rtp_origin) % RTP_MODULUS
    now_ticks = robot_now_us * 9 // _US_PER_9_TICKS
    behind = (now_ticks - ticks + RTP_MODULUS // 2) % RTP_MODULUS - RTP_MODULUS // 2
    return (now_ticks - behind) * _US_PER_9_TICKS // 9
