"""Bounds how far a value, or a vector, may go in one step.

Both clamps and slews are geometry: a clamp keeps the direction of a vector, a slew moves on the straight line from the
last output to the wish. On that line the length falls up to the point nearest to zero and rises from there on, so a
change of sign first falls to zero and then rises.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from mosaic_core.words.limits import FieldLimit

MAX_RISE_STEP_S = 0.1
"""The longest time for which one command may rise: the period of the slowest usual command loop (10 Hz)."""
ROUNDING = 1e-9


def clamped(values: list[float], limit: FieldLimit, places: tuple[int, ...]) -> None:
    """Bring the fields at ``places`` of ``values`` into ``limit``, in place."""
    for at in places:
        if limit.max is not None:
            values[at] = min(values[at], limit.max)
        if limit.min is not None:
            values[at] = max(values[at], limit.min)
    if limit.max_norm is None:
        return
    norm = math.hypot(*[values[at] for at in places])
    if norm > limit.max_norm:
        for at in places:
            values[at] = values[at] / norm * limit.max_norm


def reach(
    last: Sequence[float], target: Sequence[float], limit: FieldLimit, places: tuple[int, ...], elapsed_s: float
) -> float:
    """The share (0 to 1) of the way from ``last`` to ``target`` that ``limit`` allows in ``elapsed_s``."""
    way = [target[at] - last[at] for at in places]
    length = math.hypot(*way)
    if length == 0.0:
        return 1.0
    towards_zero = -sum(last[at] * (step / length) for at, step in zip(places, way, strict=True))
    fall = min(length, max(0.0, towards_zero))
    if length - fall <= ROUNDING * length:
        fall = length  # straight to zero: a rounding error is no rise
    rise = length - fall
    fall_s, rise_s = _seconds(fall, limit.max_fall_per_s), _seconds(rise, limit.max_rise_per_s)
    if elapsed_s < fall_s:
        return elapsed_s / fall_s * fall / length
    left_s = min(elapsed_s - fall_s, MAX_RISE_STEP_S)
    return 1.0 if left_s >= rise_s else (fall + left_s / rise_s * rise) / length


def _seconds(distance: float, max_per_s: float | None) -> float:
    return 0.0 if max_per_s is None else distance / max_per_s
