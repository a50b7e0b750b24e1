"""Moves position fields towards what is wished, no faster than their rates, from where they are.

Where it is, is the position that was put out last, as long as commands follow each other. In the beginning, after a
safe action and after a pause, something else may have moved it: then the connector is asked, and only if it can't say
is it the position that was put out last. Never is it 0 because nothing better is known.

Within its range a position never leaves it. From outside, where only a report can place it, it comes back on the
straight line at the same rate.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from mosaic_core.machines.commands.slew import MAX_RISE_STEP_S, clamped
from mosaic_core.words.errors import Refused
from mosaic_core.words.limits import FieldLimit

PAUSE_S = 1.0
"""After so long without a command something else may have moved it, or somebody's hand."""
Report: TypeAlias = Callable[[str], float | None]
"""Where a field is now by the connector's own sensors; ``None``: unknown."""


class PositionUnknown(Refused):
    """It would have to move from where it is, and nobody knows where that is. The text names the field."""

    def __init__(self, field: str) -> None:
        super().__init__("safety.position_unknown", f"nobody knows where {field} is now, so it can't be moved slowly")


class SaidInPart(Refused):
    """Fields that are limited together are not all said. The text names them."""

    def __init__(self, fields: Iterable[str]) -> None:
        super().__init__("safety.out_of_range", f"{' and '.join(fields)} are limited together: say all of them")


@dataclass(frozen=True, slots=True)
class HeldPosition:
    """The position that a field was sent to last. ``is_sure``: nothing but commands has moved it since."""

    value: float
    at_s: float
    is_sure: bool = True


Held: TypeAlias = Mapping[str, HeldPosition]
Group: TypeAlias = tuple[tuple[str, ...], tuple[FieldLimit, ...]]


class PositionSlew:
    """The rates and ranges of the position fields of one receiver."""

    def __init__(self, fields: Sequence[str], limits: Sequence[FieldLimit], report: Report) -> None:
        self._groups = _groups(fields, limits)
        self._report = report

    def moved(self, goals: Mapping[str, float], held: Held, factor: float, now_s: float) -> dict[str, float]:
        """Where to send the fields of ``goals`` now, at ``factor`` (0 to 1) of their rates; 0 holds. Raises
        :class:`PositionUnknown` or :class:`SaidInPart`."""
        out: dict[str, float] = {}
        for fields, limits in self._groups:
            if not any(field in goals for field in fields):
                continue
            if not all(field in goals for field in fields):
                raise SaidInPart(fields)
            target = _within([goals[field] for field in fields], fields, limits)
            rates = [one for one in limits if one.max_rate_per_s is not None]
            if rates or factor == 0.0:
                start = [self._start(field, held, now_s) for field in fields]
                elapsed_s = min(_elapsed_s(held.get(field), now_s) for field in fields)
                target = _on_the_way(start, target, _share(start, target, fields, rates, factor, elapsed_s))
            out.update(zip(fields, target, strict=True))
        return out

    def _start(self, field: str, held: Held, now_s: float) -> float:
        last = held.get(field)
        if last is not None and last.is_sure and now_s - last.at_s < PAUSE_S:
            return last.value
        reported = self._report(field)
        if reported is not None and math.isfinite(reported):
            return float(reported)
        if last is None:
            raise PositionUnknown(field)
        return last.value


def _within(target: list[float], fields: tuple[str, ...], limits: Iterable[FieldLimit]) -> list[float]:
    for limit in limits:
        clamped(target, limit, tuple(fields.index(field) for field in limit.fields))
    return target


def _elapsed_s(last: HeldPosition | None, now_s: float) -> float:
    """A pause saves up no jump; the first command acts as if one period had passed."""
    return MAX_RISE_STEP_S if last is None else max(0.0, min(now_s - last.at_s, MAX_RISE_STEP_S))


def _share(
    start: Sequence[float],
    target: Sequence[float],
    fields: tuple[str, ...],
    rates: Iterable[FieldLimit],
    factor: float,
    elapsed_s: float,
) -> float:
    """The share (0 to 1) of the way that the slowest of ``rates`` allows."""
    if factor == 0.0:
        return 0.0
    share = 1.0
    for limit in rates:
        assert limit.max_rate_per_s is not None
        length = math.hypot(*[target[at] - start[at] for at in (fields.index(field) for field in limit.fields)])
        step = limit.max_rate_per_s * factor * elapsed_s
        if step < length:
            share = min(share, step / length)
    return share


def _on_the_way(start: list[float], target: list[float], share: float) -> list[float]:
    """Rounding must leave neither the way nor, with it, the range."""
    if share == 1.0:
        return target
    return [
        max(min(one, other), min(max(one, other), one + share * (other - one)))
        for one, other in zip(start, target, strict=True)
    ]


def _groups(fields: Iterable[str], limits: Iterable[FieldLimit]) -> tuple[Group, ...]:
    """Limits that share a field move together, and only as far as the slowest of them allows."""
    groups: list[Group] = [((field,), ()) for field in fields]
    for limit in limits:
        apart = [group for group in groups if not set(group[0]) & set(limit.fields)]
        joined = [group for group in groups if group not in apart]
        names = tuple(name for one, _ in joined for name in one)
        groups = [*apart, (names, (*(its for _, ones in joined for its in ones), limit))]
    return tuple(groups)
