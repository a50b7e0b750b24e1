"""The packets of LDROBOT's LD19, LD06 and STL-19P, as their development manuals describe them. Pure.

47 bytes at 230400 baud: 54 2C, speed (°/s), start angle (0.01°), twelve times distance (mm) and intensity, end angle
(0.01°), timestamp (ms), CRC-8; numbers are little-endian, angles clockwise.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator

import numpy as np

from mosaic_sensors.lidars.turns import Points, TurnCutter

BAUD = 230_400
RAYS = 450
"""4500 points a second, ten turns."""
HEADER = b"\x54\x2c"
PACKET_BYTES = 47
_POINTS = 12
_FULL_TURN = 36_000
_LAYOUT = struct.Struct("<2sHH" + "HB" * _POINTS + "HHB")
_POLYNOMIAL = 0x4D


def _crc_of_byte(value: int) -> int:
    for _ in range(8):
        value = (value << 1) ^ (_POLYNOMIAL if value & 0x80 else 0)
    return value & 0xFF


_CRCS = bytes(map(_crc_of_byte, range(256)))


def crc8(data: bytes) -> int:
    """The CRC-8 of ``data``: polynomial 0x4D, begins with 0, nothing is reflected."""
    crc = 0
    for byte in data:
        crc = _CRCS[crc ^ byte]
    return crc


class Ld19Parser:
    """Finds packets between whatever else there is."""

    def __init__(self) -> None:
        self.bad_packets = 0
        self._rest = b""
        self._turns = TurnCutter()
        self._last_angle = 0.0

    def feed(self, data: bytes) -> list[Points]:
        return [turn for packet in self._packets(data) for turn in self._turns_of(_points_of(packet))]

    def _packets(self, data: bytes) -> Iterator[bytes]:
        self._rest += data
        while True:
            start = self._rest.find(HEADER)
            if start < 0:
                self._rest = self._rest[-1:] if self._rest.endswith(HEADER[:1]) else b""
                return
            packet = self._rest[start : start + PACKET_BYTES]
            if len(packet) < PACKET_BYTES:
                self._rest = self._rest[start:]
                return
            is_good = crc8(packet[:-1]) == packet[-1]
            self.bad_packets += not is_good
            self._rest = self._rest[start + (PACKET_BYTES if is_good else 1) :]
            if is_good:
                yield packet

    def _turns_of(self, points: Points) -> Iterator[Points]:
        """A turn ends where the angle falls by more than half a one."""
        before = np.concatenate([[self._last_angle], points[:-1, 0]])
        self._last_angle = float(points[-1, 0])
        begin = 0
        for end in np.flatnonzero(points[:, 0] - before < -math.pi):
            self._turns.add(points[begin:end])
            turn = self._turns.end()
            if turn is not None:
                yield turn
            begin = int(end)
        self._turns.add(points[begin:])


def _points_of(packet: bytes) -> Points:
    _, _, start, *measured, end, _, _ = _LAYOUT.unpack(packet)
    span = (end - start) % _FULL_TURN
    hundredths = (start + np.arange(_POINTS) * (span / (_POINTS - 1))) % _FULL_TURN
    distances_mm, intensities = np.array(measured[0::2], float), np.array(measured[1::2], float)
    return np.column_stack([np.radians(hundredths / 100), distances_mm / 1000, intensities])


def encoded_packet(
    start: int, end: int, measured: list[tuple[int, int]], speed: int = 3600, stamp_ms: int = 0
) -> bytes:
    """The packet that says so: angles in 0.01°, twelve times (mm, intensity); for the scanner that is made up."""
    flat = [number for point in measured for number in point]
    body = _LAYOUT.pack(HEADER, speed, start, *flat, end, stamp_ms, 0)[:-1]
    return body + bytes([crc8(body)])
