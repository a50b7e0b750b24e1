"""Scanners that are made up: they stand in a room of 4 m by 6 m."""

from __future__ import annotations

import math
from collections.abc import Iterator

from mosaic_sensors.lidars import ld19, rplidar

HALF_WIDTH_M, HALF_LENGTH_M = 2.0, 3.0
_FULL_TURN = 36_000
LD19_TURN_S, RPLIDAR_TURN_S = 0.1, 0.18


def wall_m(angle_rad: float) -> float:
    """How far it is to the wall: ahead and behind 3 m, to both sides 2 m."""
    return min(HALF_LENGTH_M / max(abs(math.cos(angle_rad)), 1e-9), HALF_WIDTH_M / max(abs(math.sin(angle_rad)), 1e-9))


def ld19_pieces() -> Iterator[tuple[float, bytes]]:
    """What an LD19 says: a turn at a time, without end."""
    step = _FULL_TURN // ld19.RAYS
    packets = [_packet(start, step) for start in range(0, 2 * _FULL_TURN, 12 * step)]
    middle = len(packets) // 2
    while True:
        yield LD19_TURN_S, b"".join(packets[:middle])
        yield LD19_TURN_S, b"".join(packets[middle:])


def _packet(start: int, step: int) -> bytes:
    angles = [(start + one * step) % _FULL_TURN for one in range(12)]
    return ld19.encoded_packet(angles[0], angles[-1], [(_mm(angle), 200) for angle in angles])


def _mm(hundredths: int) -> int:
    return round(wall_m(math.radians(hundredths / 100)) * 1000)


def rplidar_pieces() -> Iterator[tuple[float, bytes]]:
    """What an RPLIDAR says after it was told to scan: a turn at a time, without end."""
    turn = b"".join(
        rplidar.encoded_node(degree * 64, round(wall_m(math.radians(degree)) * 4000), 47, begins=degree == 0)
        for degree in range(360)
    )
    yield 0.0, rplidar.SCAN_BEGINS
    while True:
        yield RPLIDAR_TURN_S, turn
