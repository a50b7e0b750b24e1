"""Finds the calibration of an arm that a person moves by hand: first to the middle of all ranges, then through them."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

from mosaic_arm.calibration import TICKS_PER_TURN, MotorCalibration
from mosaic_core.words.errors import MosaicError

MIDDLE = TICKS_PER_TURN // 2 - 1
"""What a motor shall tell in the middle of its joint's range, so that the range does not cross the end of a turn."""
LEAST_RANGE = 100
"""Ticks; a joint that moved less was not moved."""


def middle_offset(ticks: int, *, is_added: bool) -> int:
    """The offset with which a motor that tells ``ticks`` without one tells :data:`MIDDLE`. ``is_added``: the series
    adds it to the angle (Dynamixel) instead of taking it away (Feetech)."""
    away = ticks % TICKS_PER_TURN - MIDDLE
    return -away if is_added else min(away, MIDDLE)


@dataclass(slots=True)
class RangeRecorder:
    """Least and greatest ticks of each joint that were seen. ``full_turn``: joints without an end."""

    full_turn: Collection[str] = ()
    seen: dict[str, tuple[int, int]] = field(default_factory=dict)

    def saw(self, ticks: Mapping[str, int]) -> None:
        for name, value in ticks.items():
            low, high = self.seen.get(name, (value, value))
            self.seen[name] = min(low, value), max(high, value)

    def calibrations(self, ids: Mapping[str, int], offsets: Mapping[str, int]) -> dict[str, MotorCalibration]:
        """Raises :class:`MosaicError` that names the joints which were not moved."""
        ranges = {name: (0, TICKS_PER_TURN - 1) if name in self.full_turn else self.seen[name] for name in ids}
        idle = [name for name, (low, high) in ranges.items() if high - low < LEAST_RANGE]
        if idle:
            cure = "Calibrate again, and move each joint from one end to the other."
            message = f"these joints were hardly moved: {', '.join(idle)}. {cure}"
            raise MosaicError(message, code="config.invalid", cure=cure)
        return {
            name: MotorCalibration(
                id=ids[name], homing_offset=offsets[name], range_min=ranges[name][0], range_max=ranges[name][1]
            )
            for name in ids
        }
