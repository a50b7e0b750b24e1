"""The body of a vehicle that is made up: a point that follows its velocity at once, over flat ground. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass

HOME = (47.3977, 8.5456)
"""Where PX4's simulators begin: Zürich, degrees."""
HOME_ALTITUDE_M = 488.0
METRES_PER_DEGREE = 111_194.9
CLIMB_MPS = 2.0
RETURN_MPS = 4.0


@dataclass(slots=True)
class FakeBody:
    """Where it is (metres north, east and up of home), its yaw clockwise from north, and how it moves."""

    flies: bool = True
    north_m: float = 0.0
    east_m: float = 0.0
    up_m: float = 0.0
    yaw_rad: float = 0.0
    forward_mps: float = 0.0
    right_mps: float = 0.0
    up_mps: float = 0.0
    yaw_radps: float = 0.0
    target_up_m: float | None = None
    """A height that it climbs or sinks to by itself."""
    returns: bool = False

    def stand_still(self) -> None:
        """No velocity any more."""
        self.forward_mps = self.right_mps = self.up_mps = self.yaw_radps = 0.0

    @property
    def north_mps(self) -> float:
        return self.forward_mps * math.cos(self.yaw_rad) - self.right_mps * math.sin(self.yaw_rad)

    @property
    def east_mps(self) -> float:
        return self.forward_mps * math.sin(self.yaw_rad) + self.right_mps * math.cos(self.yaw_rad)

    @property
    def latitude(self) -> float:
        return HOME[0] + self.north_m / METRES_PER_DEGREE

    @property
    def longitude(self) -> float:
        return HOME[1] + self.east_m / (METRES_PER_DEGREE * math.cos(math.radians(HOME[0])))

    def move(self, seconds: float) -> None:
        """Let time pass."""
        if self.target_up_m is not None:
            gap_m = self.target_up_m - self.up_m
            self.up_mps = max(-CLIMB_MPS, min(CLIMB_MPS, gap_m / seconds if seconds > 0 else 0.0))
        self.yaw_rad = math.remainder(self.yaw_rad + self.yaw_radps * seconds, math.tau)
        self.north_m += self.north_mps * seconds
        self.east_m += self.east_mps * seconds
        self.up_m = max(0.0, self.up_m + self.up_mps * seconds) if self.flies else 0.0
        if self.returns:
            self._go_home(seconds)

    def _go_home(self, seconds: float) -> None:
        far_m = math.hypot(self.north_m, self.east_m)
        left = max(0.0, 1.0 - RETURN_MPS * seconds / far_m) if far_m > 0 else 0.0
        self.north_m, self.east_m = self.north_m * left, self.east_m * left
        if far_m == 0.0:
            self.target_up_m = 0.0
