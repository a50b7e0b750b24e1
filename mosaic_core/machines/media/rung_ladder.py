"""The rungs of one camera: the full picture and cheaper ones, each for a range of bit rates that joins the next one's.

A rung's bit rate follows the slowest of its viewers, who is never slower than the rung's floor: below it he is on the
next rung. So viewers can share encoders without one bad link spoiling everybody's picture.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

Preset: TypeAlias = Literal["drive", "inspect"]

BITS_PER_PIXEL = {"drive": 0.085, "inspect": 0.12}
"""Ceiling of a picture's bit rate when the configuration names none. For driving, a larger picture is a later one, and
loses packets more often: 0.085 is four fifths of 1 Mbit/s at 640x480, and of 3 Mbit/s at 1280x720. Above 0.12,
sharpness hardly gains."""
ASSUMED_FPS = 30.0
MIN_CEILING_BPS = 300_000
MAX_CEILING_BPS = 8_000_000
MIN_WIDTH, MIN_HEIGHT = 160, 90
"""A smaller picture shows nothing to drive by."""
_RATE_EXPONENT = 0.75
"""Bit rate for the same quality grows with (pixels x rate)^0.75: larger pictures hold more of the same."""
_OVERLAP = 0.75
"""A rung's floor, relative to the ceiling of the rung below: without overlap, a link between two would flap."""

_STEPS: dict[str, tuple[tuple[float, int], ...]] = {
    "drive": ((1.0, 1), (2 / 3, 1), (1 / 2, 1), (1 / 3, 2)),
    "inspect": ((1.0, 1), (1.0, 2), (2 / 3, 3), (1 / 2, 3)),
}
"""Per preset and rung: scale of each side, and of how many pictures one is taken. Driving needs fluid motion before
sharpness, inspecting the opposite."""


@dataclass(frozen=True, slots=True)
class Rung:
    """One size and range of bit rates of a camera's pictures. ``frame_step``: one picture of so many. Its encoder's bit
    rate is between ``floor_bps`` and ``ceiling_bps``.
    """

    width: int
    height: int
    frame_step: int
    floor_bps: int
    ceiling_bps: int


def ladder(
    width: int,
    height: int,
    *,
    max_bps: int | None = None,
    min_bps: int = 150_000,
    preset: Preset = "drive",
    rungs: int = 3,
) -> tuple[Rung, ...]:
    """The rungs for a source, best first; at least one."""
    top_bps = max(min_bps, max_bps or default_ceiling_bps(width, height, preset))
    steps = [
        (scale, step)
        for scale, step in _STEPS[preset][:rungs]
        if scale == 1.0 or (width * scale >= MIN_WIDTH and height * scale >= MIN_HEIGHT)
    ]
    ceilings = [round(top_bps * (scale * scale / step) ** _RATE_EXPONENT) for scale, step in steps]
    usable = [index for index, ceiling in enumerate(ceilings) if index == 0 or ceiling > min_bps]
    made = []
    for index in usable:
        is_last = index == usable[-1]
        floor_bps = min_bps if is_last else max(min_bps, round(ceilings[index + 1] * _OVERLAP))
        scale, step = steps[index]
        made.append(Rung(_even(width * scale), _even(height * scale), step, floor_bps, ceilings[index]))
    return tuple(made)


def default_ceiling_bps(width: int, height: int, preset: Preset = "drive") -> int:
    """The bit rate above which more would hardly be seen."""
    wanted_bps = width * height * ASSUMED_FPS * BITS_PER_PIXEL[preset]
    return round(min(MAX_CEILING_BPS, max(MIN_CEILING_BPS, wanted_bps)))


def _even(side: float) -> int:
    """4:2:0 pictures have even sides."""
    return max(2, round(side / 2) * 2)
