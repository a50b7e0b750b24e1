"""The robot's monotonic clock as wall time, for everything that is written together.

The distance is measured once: whatever corrects the wall clock later, all files stay on one time line.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from datetime import UTC, datetime


def _distance_ns() -> int:
    before_ns, wall_ns, after_ns = time.monotonic_ns(), time.time_ns(), time.monotonic_ns()
    return wall_ns - (before_ns + after_ns) // 2


@dataclass(frozen=True, slots=True)
class RobotClock:
    """Turns seconds of the robot's monotonic clock into nanoseconds since 1970. ``zero_ns``: when it stood at 0."""

    zero_ns: int = field(default_factory=_distance_ns)

    def wall_ns(self, at_s: float) -> int:
        return max(0, round(at_s * 1e9) + self.zero_ns)

    def wall(self, at_s: float) -> datetime:
        """Down to the microsecond, UTC."""
        return datetime.fromtimestamp(self.wall_ns(at_s) / 1e9, UTC)
