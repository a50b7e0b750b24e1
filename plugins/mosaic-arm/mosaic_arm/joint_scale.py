"""Turns ticks of a motor into radians of its joint and back: direction, zero and whole turns."""

from __future__ import annotations

import math
from dataclasses import dataclass

from mosaic_arm.calibration import TICKS_PER_TURN, MotorCalibration

RAD_PER_TICK = math.tau / TICKS_PER_TURN
UNCALIBRATED = MotorCalibration(id=0, range_min=0, range_max=TICKS_PER_TURN - 1)


@dataclass(frozen=True, slots=True)
class JointScale:
    """The scale of one joint: zero is the middle of the range, and no goal leaves the range."""

    range_min: int
    range_max: int
    is_reversed: bool = False

    @classmethod
    def of(cls, calibration: MotorCalibration) -> JointScale:
        return cls(calibration.range_min, calibration.range_max, bool(calibration.drive_mode))

    @property
    def middle(self) -> float:
        """The ticks of 0 rad."""
        return (self.range_min + self.range_max) / 2

    @property
    def limits_rad(self) -> tuple[float, float]:
        """Least and greatest angle within the range."""
        reach = (self.range_max - self.range_min) / 2 * RAD_PER_TICK
        return -reach, reach

    def angle_rad(self, ticks: int) -> float:
        """The angle of a reading. Readings that differ by whole turns are one place: the one within half a turn of the
        middle, as the range is."""
        away = (ticks - self.middle + TICKS_PER_TURN / 2) % TICKS_PER_TURN - TICKS_PER_TURN / 2
        return (-away if self.is_reversed else away) * RAD_PER_TICK

    def goal_ticks(self, angle_rad: float) -> int:
        """The nearest ticks for an angle, within the range. Raises :class:`ValueError` for what is no number."""
        if not math.isfinite(angle_rad):
            raise ValueError(f"{angle_rad} is no angle")
        away = angle_rad / RAD_PER_TICK
        return round(min(max(self.middle + (-away if self.is_reversed else away), self.range_min), self.range_max))

    def goal_near(self, angle_rad: float, present_ticks: int) -> int:
        """The same, in the turn in which the motor counts now: one that counts on over several turns would unwind."""
        goal = self.goal_ticks(angle_rad)
        turn = math.floor((present_ticks - self.middle + TICKS_PER_TURN / 2) / TICKS_PER_TURN)
        return goal + turn * TICKS_PER_TURN

    def speed_radps(self, ticks_per_s: float) -> float:
        return (-ticks_per_s if self.is_reversed else ticks_per_s) * RAD_PER_TICK
