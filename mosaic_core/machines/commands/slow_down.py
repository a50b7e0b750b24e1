"""Computes how much of the speed is left on a bad link: the least that any curve leaves, and which causes take it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

from mosaic_core.words.limits import Curve, SlowDownCurves

CauseName = Literal["rtt", "loss", "picture"]
REPORT_PERIOD_S = 0.2
FACTOR_STEP = 0.02
VALUE_STEP = 0.1


@dataclass(frozen=True, slots=True)
class Measures:
    """The link of one peer. ``None``: not known. ``picture_ms``: age of what the operator looks at."""

    rtt_ms: float | None = None
    loss: float | None = None
    picture_ms: float | None = None


@dataclass(frozen=True, slots=True)
class Cause:
    """Something that limits the speed. ``value`` in milliseconds, for ``loss`` a share; ``None``: no picture at all."""

    cause: CauseName
    value: float | None
    factor: float


def slow_down(curves: SlowDownCurves, measures: Measures) -> tuple[float, tuple[Cause, ...]]:
    """The factor (0 to 1) for commands, and everything that makes it less than 1, worst first."""
    measured: tuple[tuple[CauseName, float, float | None], ...] = (
        ("rtt", _left(curves.rtt_ms, measures.rtt_ms), measures.rtt_ms),
        ("loss", _left(curves.loss, measures.loss), measures.loss),
        ("picture", picture_factor(curves, measures), measures.picture_ms),
    )
    causes = [
        Cause(name, value if value is not None and math.isfinite(value) else None, factor)
        for name, factor, value in measured
        if factor < 1.0
    ]
    causes.sort(key=lambda cause: cause.factor)
    return (causes[0].factor if causes else 1.0), tuple(causes)


def link_factor(curves: SlowDownCurves, measures: Measures) -> float:
    """What round trip and loss leave."""
    return min(_left(curves.rtt_ms, measures.rtt_ms), _left(curves.loss, measures.loss))


def picture_factor(curves: SlowDownCurves, measures: Measures) -> float:
    """What the age of the picture leaves; nothing where one is required and there is none."""
    if curves.picture == "off" or curves.picture_ms is None:
        return 1.0
    if measures.picture_ms is None:
        return 0.0 if curves.picture == "required" else 1.0
    return on_curve(curves.picture_ms, measures.picture_ms)


def _left(curve: Curve | None, value: float | None) -> float:
    return 1.0 if curve is None or value is None else on_curve(curve, value)


def on_curve(curve: Curve, value: float) -> float:
    """The factor at ``value``: linear between points, flat outside; for NaN the last factor, the least of all."""
    if value <= curve[0][0]:
        return curve[0][1]
    for (left, high), (right, low) in pairwise(curve):
        if value < right:
            return max(low, min(high, high + (low - high) * ((value - left) / (right - left))))
    return curve[-1][1]


class LimitReport:
    """Decides when a speed limit is worth telling: on a change that one can see, and at most five times a second."""

    def __init__(self) -> None:
        self._told: tuple[float, tuple[Cause, ...]] = (1.0, ())
        self._at_s: float | None = None

    def is_due(self, factor: float, causes: tuple[Cause, ...], now_s: float) -> bool:
        """``True``: tell it now; it counts as told."""
        if self._at_s is not None and now_s - self._at_s < REPORT_PERIOD_S:
            return False
        if not _differs(self._told, (factor, causes)):
            return False
        self._told, self._at_s = (factor, causes), now_s
        return True


def _differs(old: tuple[float, tuple[Cause, ...]], new: tuple[float, tuple[Cause, ...]]) -> bool:
    if abs(old[0] - new[0]) >= FACTOR_STEP or (old[0] != new[0] and new[0] in (0.0, 1.0)):
        return True
    values = {cause.cause: cause.value for cause in old[1]}
    if set(values) != {cause.cause for cause in new[1]}:
        return True
    return any(_value_differs(values[cause.cause], cause.value) for cause in new[1])


def _value_differs(old: float | None, new: float | None) -> bool:
    if old is None or new is None:
        return old is not new
    return abs(new - old) >= VALUE_STEP * max(abs(old), 1e-9)
