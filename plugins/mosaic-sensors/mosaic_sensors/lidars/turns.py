"""Points of a turning scanner to whole turns, and a turn to a scan. Pure.

Written by hand: the packages that read these scanners (rplidar-roboticia, adafruit-circuitpython-rplidar) open ports
and wait by themselves, and give no bytes in.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from mosaic_sensors.laser_scan import Scan, scan_of

MAX_TURN_POINTS = 16_384
"""More than any of them measures: one whose turn does not end costs no memory."""

Points = NDArray[np.float64]
"""(n, 3): angle in rad, clockwise seen from above, from its front; distance in m, 0 for no return; intensity."""


class TurnParser(Protocol):
    """Reads the bytes of one kind of scanner."""

    bad_packets: int
    """What looked like one of its packets and was none."""

    def feed(self, data: bytes) -> list[Points]:
        """The turns that ``data`` ends, wherever the stream is cut."""
        ...


@dataclass(slots=True)
class TurnCutter:
    """Collects points until their turn ends. The first turn is left out: it begins anywhere."""

    _pieces: list[Points] = field(default_factory=list)
    _count: int = 0
    _is_whole: bool = False

    def add(self, points: Points) -> None:
        """Add points of the turn that is under way."""
        if self._count + len(points) > MAX_TURN_POINTS:
            self._pieces, self._count, self._is_whole = [], 0, False
            return
        self._pieces.append(points)
        self._count += len(points)

    def end(self) -> Points | None:
        """The turn that ends here, if it was seen from its beginning."""
        turn = np.concatenate(self._pieces) if self._is_whole and self._pieces else None
        self._pieces, self._count, self._is_whole = [], 0, True
        return turn


@dataclass(frozen=True, slots=True)
class Mounting:
    """How a scanner sits on the robot, and how finely its turn is told."""

    rays: int
    yaw_rad: float = 0.0
    is_upside_down: bool = False
    range_min_m: float = 0.0
    range_max_m: float = math.inf

    def scan(self, turn: Points, frame_id: str, now_s: float, scan_time_s: float) -> Scan:
        """The nearest return of each ray, on a grid of ``rays`` around the robot, which begins behind it."""
        increment = math.tau / self.rays
        angles = (turn[:, 0] if self.is_upside_down else -turn[:, 0]) + self.yaw_rad
        farthest_first = turn[:, 1].argsort()[::-1]  # what is written last stays: the nearest
        is_return = turn[farthest_first, 1] > 0
        chosen = farthest_first[is_return]
        places = np.rint((angles[chosen] + math.pi) / increment).astype(np.int64) % self.rays
        ranges, intensities = np.full(self.rays, np.nan), np.zeros(self.rays)
        ranges[places], intensities[places] = turn[chosen, 1], turn[chosen, 2]
        return scan_of(
            ranges,
            -math.pi,
            increment,
            intensities=intensities,
            range_min_m=self.range_min_m,
            range_max_m=self.range_max_m,
            scan_time_s=scan_time_s,
            frame_id=frame_id,
            captured_at_s=now_s,
        )
