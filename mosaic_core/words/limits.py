"""Holds the limits of a command: the fields of a message and how far and how fast they may go, and the curves that slow
down.

Fields are dotted paths of the JSON message (``linear.x``), in a list ``positions.shoulder``, by index ``positions.0``,
and for each of its numbers ``positions.*``. Units are those of the message.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, get_args

Curve = tuple[tuple[float, float], ...]
"""Points ``(value, factor)`` of a piecewise linear curve; flat before the first and after the last."""
PictureRule = Literal["off", "if_watching", "required"]
MotionKind = Literal["velocity", "position"]
"""What a number of a command means: a velocity is 0 at a standstill; for a position 0 is a place like any
other."""
MOTION_KINDS: tuple[MotionKind, ...] = get_args(MotionKind)


class ImpossibleLimit(ValueError):
    """A limit that nothing can follow. ``key``: what of it is wrong, where that is one thing; ``cure``: what to write
    instead; ``is_order``: its min is above its max."""

    def __init__(self, message: str, *, key: str = "", cure: str = "", is_order: bool = False) -> None:
        super().__init__(message)
        self.key = key
        self.cure = cure
        self.is_order = is_order


@dataclass(frozen=True, slots=True)
class FieldLimit:
    """Limits of one field, or of several that form a vector (then ``max_norm`` and the rates mean its length).

    ``min`` and ``max`` hold for each field. Rates are per second: of a velocity ``max_rise_per_s`` away from zero and
    ``max_fall_per_s`` towards it, of a position ``max_rate_per_s`` in any direction. ``None``: unlimited. Raises
    :class:`ImpossibleLimit` for a range without a value, or a velocity without a standstill.
    """

    fields: tuple[str, ...]
    min: float | None = None
    max: float | None = None
    max_norm: float | None = None
    max_rise_per_s: float | None = None
    max_fall_per_s: float | None = None
    max_rate_per_s: float | None = None
    kind: MotionKind = "velocity"

    def __post_init__(self) -> None:
        name = " and ".join(self.fields)
        if not self.fields or len(set(self.fields)) != len(self.fields):
            raise ImpossibleLimit("a limit needs the names of its fields, each once")
        if any(not part for field in self.fields for part in field.split(".")):
            raise ImpossibleLimit(f"limit of {name!r}: a field is a dotted path like linear.x")
        if len(self.fields) > 1 and any(field.endswith(".*") for field in self.fields):
            raise ImpossibleLimit(f"limit of {name}: what is limited together is named one by one, not by *")
        rates = (self.max_rise_per_s, self.max_fall_per_s, self.max_rate_per_s)
        numbers = (self.min, self.max, self.max_norm, *rates)
        if any(number is not None and not math.isfinite(number) for number in numbers):
            raise ImpossibleLimit(f"limit of {name}: every number must be finite")
        if self.max_norm is not None and self.max_norm < 0:
            raise ImpossibleLimit(f"limit of {name}: max_norm can't be negative", key="max_norm")
        if any(rate is not None and rate <= 0 for rate in rates):
            raise ImpossibleLimit(f"limit of {name}: a rate must be positive, or it could never change")
        if self.kind == "position":
            self._check_position(name)
        else:
            self._check_velocity(name)

    def _check_velocity(self, name: str) -> None:
        self._check_order(name, "velocity")
        for key, is_wrong in (("min", (self.min or 0) > 0), ("max", (self.max or 0) < 0)):
            if is_wrong:
                message = f"limit of {name}: zero must be allowed (min <= 0 <= max), or nothing could stand still"
                cure = "where 0 is no standstill write `kind: position`, or name it in position_fields of its class"
                raise ImpossibleLimit(message, key=key, cure=cure)
        if self.max_rate_per_s is not None:
            message = f"limit of {name}: max_rate_per_s is for a position, and this is a velocity"
            cure = "write max_rise_per_s and max_fall_per_s, or `kind: position` if 0 is no standstill"
            raise ImpossibleLimit(message, key="max_rate_per_s", cure=cure)

    def _check_position(self, name: str) -> None:
        for key in ("max_rise_per_s", "max_fall_per_s"):
            if getattr(self, key) is not None:
                message = f"limit of {name}: {key} is for a velocity, and this is a position"
                raise ImpossibleLimit(message, key=key, cure="write max_rate_per_s, which holds in any direction")
        self._check_order(name, "position")

    def _check_order(self, name: str, noun: str) -> None:
        if self.min is not None and self.max is not None and self.min > self.max:
            message = f"limit of {name}: min {self.min:g} is above max {self.max:g}, so no {noun} is left"
            raise ImpossibleLimit(message, key="min", cure="swap them", is_order=True)


def clashes(limits: Iterable[FieldLimit]) -> Iterator[tuple[str, str]]:
    """``(field, what is wrong)`` of every field that several limits hold, which can't all be kept."""
    by_field: dict[str, list[FieldLimit]] = {}
    for limit in limits:
        for field in limit.fields:
            by_field.setdefault(field, []).append(limit)
    for field, its in by_field.items():
        low = max((one.min for one in its if one.min is not None), default=-math.inf)
        high = min((one.max for one in its if one.max is not None), default=math.inf)
        if len({one.kind for one in its}) > 1:
            yield field, f"'{field}' is limited as a velocity and as a position"
        elif low > high:
            yield field, f"no position is left for '{field}': at least {low:g} and at most {high:g}"
        elif not low <= 0 <= high and any(one.max_norm is not None for one in its):
            yield field, f"'{field}' has a max_norm, the distance from 0, and a range without 0"


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
