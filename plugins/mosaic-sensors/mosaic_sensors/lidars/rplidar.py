"""The measurements of Slamtec's RPLIDAR A1, A2 and A3 in their standard scan, as the interface protocol describes them.
Pure.

Five bytes each: quality with the bits "a turn begins" and its opposite, angle (1/64°, clockwise) with a bit that is 1,
distance (1/4 mm). There is no checksum, so several in a row must make sense before any is believed.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from mosaic_sensors.lidars.turns import Points, TurnCutter

BAUD = 115_200
RAYS = 360
"""2000 points a second and 5.5 turns, which is what an A1 does at least."""
STOP, SCAN = b"\xa5\x25", b"\xa5\x20"
SCAN_BEGINS = b"\xa5\x5a\x05\x00\x00\x40\x81"
"""The answer to :data:`SCAN`; measurements follow."""
MOTOR_PWM = 660
"""What the maker's own programs set an A2 or A3 to; an A1 hears DTR alone."""
NODE_BYTES = 5
_BELIEVED = 8
"""One byte in eight looks like the beginning of one; after noise, so many in a row are no accident."""
_FULL_TURN = 360 * 64
_NODE = np.dtype([("first", "u1"), ("angle", "<u2"), ("distance", "<u2")])

Nodes: TypeAlias = NDArray[np.void]


def motor_command(pwm: int) -> bytes:
    """Turn the motor of an A2 or A3: 0 stops it."""
    command = b"\xa5\xf0\x02" + pwm.to_bytes(2, "little")
    checksum = 0
    for byte in command:
        checksum ^= byte
    return command + bytes([checksum])


def encoded_node(angle_64ths: int, quarter_mm: int, quality: int, begins: bool = False) -> bytes:
    """The measurement that says so; for the scanner that is made up."""
    node = np.array((quality << 2 | (1 if begins else 2), angle_64ths << 1 | 1, quarter_mm), _NODE)
    return node.tobytes()


class RplidarParser:
    """Finds measurements between whatever else there is."""

    def __init__(self) -> None:
        self.bad_packets = 0
        self._rest = b""
        self._needed = _BELIEVED
        self._turns = TurnCutter()

    def feed(self, data: bytes) -> list[Points]:
        return [turn for nodes in self._blocks(data) for turn in self._turns_of(nodes)]

    def _turns_of(self, nodes: Nodes) -> Iterator[Points]:
        points = np.column_stack(
            [np.radians((nodes["angle"] >> 1) / 64), nodes["distance"] / 4000, (nodes["first"] >> 2).astype(float)]
        )
        begin = 0
        for end in np.flatnonzero(nodes["first"] & 1):
            self._turns.add(points[begin:end])
            turn = self._turns.end()
            if turn is not None:
                yield turn
            begin = int(end)
        self._turns.add(points[begin:])

    def _blocks(self, data: bytes) -> Iterator[Nodes]:
        """Measurements in a row, between what is none."""
        self._rest += data
        while (whole := len(self._rest) // NODE_BYTES) >= self._needed:
            nodes = np.frombuffer(self._rest, _NODE, whole if self._needed == 1 else _BELIEVED)
            good = int(np.argmin(np.append(_make_sense(nodes), False)))
            if good >= self._needed:
                yield nodes[:good]
                self._rest, self._needed = self._rest[good * NODE_BYTES :], 1
            elif self._needed == 1:
                self._needed = _BELIEVED
                self.bad_packets += 1
            else:
                self._rest = self._rest[1:]


def _make_sense(nodes: Nodes) -> NDArray[np.bool_]:
    begins, angles = nodes["first"], nodes["angle"]
    sense: NDArray[np.bool_] = ((begins ^ begins >> 1) & 1 == 1) & (angles & 1 == 1) & (angles >> 1 < _FULL_TURN)
    return sense
