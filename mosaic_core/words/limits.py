"""Holds the limits of a command: the fields of a message and how far and how fast they may go, and the curves that slow
down.

Fields are dotted paths of the JSON message (``linear.x``). Units are those of the message.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

Curve = tuple[tuple[float, float], ...]
"""Points ``(value, factor)`` of a piecewise linear curve; flat before the first and after the last."""
PictureRule = Literal["off", "if_watching", "required"]
MotionKind = Literal["velocity", "position"]
"""What a number of a command means: a velocity is 0 at a standstill, a position stays where it was told."""


@dataclass(frozen=True, slots=True)
class FieldLimit:
    """Limits of one field, or of several that form a vector (then ``max_norm`` and the rates mean its length).

    ``min`` and ``max`` hold for each field. Rates are per second: ``max_rise_per_s`` away from zero,
    ``max_fall_per_s`` towards it. ``None``: unlimited. Raises :class:`ValueError` for limits without a standstill.
    """

    fields: tuple[str, ...]
    min: float | None = None
    max: float | None = None
    max_norm: float | None = None
    max_rise_per_s: float | None = None
    max_fall_per_s: float | None = None

    def __post_init__(self) -> None:
        name = " and ".join(self.fields)
        if not self.fields or len(set(self.fields)) != len(self.fields):
            raise ValueError("a limit needs the names of its fields, each once")
        if any(not part for field in self.fields for part in field.split(".")):
            raise ValueError(f"limit of {name!r}: a field is a dotted path like linear.x")
        numbers = (self.min, self.max, self.max_norm, self.max_rise_per_s, self.max_fall_per_s)
        if any(number is not None and not math.isfinite(number) for number in numbers):
            raise ValueError(f"limit of {name}: every number must be finite")
        if (self.min is not None and self.min > 0) or (self.max is not None and self.max < 0):
            raise ValueError(f"limit of {name}: zero must be allowed (min <= 0 <= max), or nothing could stand still")
        if self.max_norm is not None and self.max_norm < 0:
            raise ValueError(f"limit of {name}: max_norm can't be negative")
        if any(rate is not None and rate <= 0 for rate in (self.max_rise_per_s, self.max_fall_per_s)):
            raise ValueError(f"limit of {name}: a rate must be positive, or it could never change")


@dataclass(frozen=True, slots=True)
class SlowDownCurves:
    """The curves that say how much of the speed is left; ``None`` switches a cause off. Milliseconds for ``rtt_ms`` and
    ``picture_ms``, a share from 0 to 1 for ``loss``. Raises :class:`ValueError` for a curve that isn't one."""

    rtt_ms: Curve | None = ((150.0, 1.0), (300.0, 0.6), (600.0, 0.25), (1200.0, 0.0))
    loss: Curve | None = ((0.05, 1.0), (0.2, 0.5), (0.5, 0.2))
    picture_ms: Curve | None = ((300.0, 1.0), (600.0, 0.5), (1000.0, 0.0))
    picture: PictureRule = "if_watching"

    def __post_init__(self) -> None:
        for name in ("rtt_ms", "loss", "picture_ms"):
            curve = getattr(self, name)
            if curve is not None:
                check_curve(name, curve)
        if self.picture == "required" and self.picture_ms is None:
            raise ValueError("picture: required needs a curve picture_ms")


NO_SLOW_DOWN = SlowDownCurves(rtt_ms=None, loss=None, picture_ms=None, picture="off")
"""Of a receiver that moves nothing."""


def check_curve(name: str, curve: Curve) -> None:
    """Raise :class:`ValueError` unless values rise and factors fall within 0 to 1."""
    if not curve:
        raise ValueError(f"{name}: a curve needs at least one point [value, factor]")
    if not all(math.isfinite(number) for point in curve for number in point):
        raise ValueError(f"{name}: every number of a curve must be finite")
    if not all(0 <= factor <= 1 for _, factor in curve):
        raise ValueError(f"{name}: a factor is a number from 0 to 1")
    for (value, factor), (next_value, next_factor) in pairwise(curve):
        if next_value <= value:
            raise ValueError(f"{name}: the values of a curve must rise, {next_value:g} follows {value:g}")
        if next_factor > factor:
            raise ValueError(f"{name}: the factors of a curve must not rise, {next_factor:g} follows {factor:g}")
