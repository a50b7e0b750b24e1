"""Moves position fields towards what is wished, no faster than their rates, from where they are.

Where it is, is the position that was put out last, as long as commands follow each other. In the beginning, after a
safe action and after a pause, something else may have moved it: then the connector is asked, and only if it can't say
is it the position that was put out last. Never is it 0 because nothing better is known.

Within its range a position never leaves it. From outside, where only a report can place it, it comes back on the
straight line at the same rate.

The numbers of a list are fields like any others, though nobody knows beforehand which ones a message has: those that no
limit names are each limited as ``path.*`` says.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from mosaic_core.machines.commands.message_numbers import OutOfRange
from mosaic_core.machines.commands.number_list import MAX_NUMBERS, NumberList
from mosaic_core.machines.commands.slew import MAX_RISE_STEP_S, clamped
from mosaic_core.words.errors import Refused
from mosaic_core.words.limits import FieldLimit

PAUSE_S = 1.0
"""After so long without a command something else may have moved it, or somebody's hand."""
ReportPosition: TypeAlias = Callable[[str], float | None]
"""Where a field is now by the connector's own sensors; ``None``: unknown."""


class PositionUnknown(Refused):
    """A command would move a field from where it is, and nobody knows where that is. The text names the field."""

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


HeldPositions: TypeAlias = Mapping[str, HeldPosition]
Placed: TypeAlias = tuple[FieldLimit, tuple[int, ...]]
"""A limit, and which fields of a group it is of."""
SlewedFields: TypeAlias = tuple[tuple[str, ...], tuple[Placed, ...]]


class PositionSlew:
    """The rates and ranges of the position fields of one receiver. Of ``lists`` the fields are those that a message
    has."""

    def __init__(
        self,
        fields: Sequence[str],
        limits: Sequence[FieldLimit],
        report: ReportPosition,
        lists: Sequence[NumberList] = (),
    ) -> None:
        every = {one.every: one for one in lists}
        self._each = {
            its: tuple((limit, (0,)) for limit in limits if name in limit.fields) for name, its in every.items()
        }
        """Of each list the limits of those of its numbers that no other limit names."""
        named = [name for limit in limits for name in limit.fields]
        of_lists = {name for name in fields if any(one.holds(name) for one in lists) and name not in named}
        alone = [name for name in fields if name not in every and name not in of_lists]
        self._groups = _groups(alone, [limit for limit in limits if not any(name in every for name in limit.fields)])
        self._named = frozenset(name for names, _ in self._groups for name in names)
        self._report = report

    def moved(self, goals: Mapping[str, float], held: HeldPositions, factor: float, now_s: float) -> dict[str, float]:
        """Where to send the fields of ``goals`` now, at ``factor`` (0 to 1) of their rates; 0 holds. Raises
        :class:`PositionUnknown` or :class:`SaidInPart`."""
        out: dict[str, float] = {}
        for fields, limits in (*self._groups, *self._further(goals)):
            if not any(field in goals for field in fields):
                continue
            if not all(field in goals for field in fields):
                raise SaidInPart(fields)
            target = _within([goals[field] for field in fields], limits)
            rates = [one for one in limits if one[0].max_rate_per_s is not None]
            if rates or factor == 0.0:
                start = [self._start(field, held, now_s) for field in fields]
                elapsed_s = min(_elapsed_s(held.get(field), now_s) for field in fields)
                target = _on_the_way(start, target, _share(start, target, rates, factor, elapsed_s))
            out.update(zip(fields, target, strict=True))
        return out

    def remembered(self, held: HeldPositions, sent: Mapping[str, float], now_s: float) -> HeldPositions:
        """What is held after ``sent`` was sent. Raises :class:`OutOfRange` for more numbers of lists than anything
        has: whoever makes up names must neither fill the memory nor make it forget where a joint was sent just now."""
        after = {**held, **{name: HeldPosition(value, now_s) for name, value in sent.items()}}
        if len(after) > len(self._named) + MAX_NUMBERS:
            after = {name: one for name, one in after.items() if name in self._named or now_s - one.at_s < PAUSE_S}
            if len(after) > len(self._named) + MAX_NUMBERS:
                raise OutOfRange(f"more than {MAX_NUMBERS} positions of lists were commanded within {PAUSE_S:g} s")
        return after

    def _further(self, goals: Iterable[str]) -> list[SlewedFields]:
        """The numbers of lists that no limit names."""
        if not self._each:
            return []
        return [
            ((field,), limits)
            for field in goals
            if field not in self._named
            for one, limits in self._each.items()
            if one.holds(field)
        ]

    def _start(self, field: str, held: HeldPositions, now_s: float) -> float:
        last = held.get(field)
        if last is not None and last.is_sure and now_s - last.at_s < PAUSE_S:
            return last.value
        reported = self._report(field)
        if reported is not None and math.isfinite(reported):
            return float(reported)
        if last is None:
            raise PositionUnknown(field)
        return last.value


def _within(target: list[float], limits: Iterable[Placed]) -> list[float]:
    for limit, places in limits:
        clamped(target, limit, places)
    return target


def _elapsed_s(last: HeldPosition | None, now_s: float) -> float:
    """A pause saves up no jump; the first command acts as if one period had passed."""
    return MAX_RISE_STEP_S if last is None else max(0.0, min(now_s - last.at_s, MAX_RISE_STEP_S))


def _share(
    start: Sequence[float],
    target: Sequence[float],
    rates: Iterable[Placed],
    factor: float,
    elapsed_s: float,
) -> float:
    """The share (0 to 1) of the way that the slowest of ``rates`` allows."""
    if factor == 0.0:
        return 0.0
    share = 1.0
    for limit, places in rates:
        assert limit.max_rate_per_s is not None
        length = math.hypot(*[target[at] - start[at] for at in places])
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


def _groups(fields: Iterable[str], limits: Iterable[FieldLimit]) -> tuple[SlewedFields, ...]:
    """Limits that share a field move together, and only as far as the slowest of them allows."""
    groups: list[tuple[tuple[str, ...], tuple[FieldLimit, ...]]] = [((field,), ()) for field in fields]
    for limit in limits:
        apart = [group for group in groups if not set(group[0]) & set(limit.fields)]
        joined = [group for group in groups if group not in apart]
        names = tuple(name for one, _ in joined for name in one)
        groups = [*apart, (names, (*(its for _, ones in joined for its in ones), limit))]
    return tuple((names, tuple((its, tuple(map(names.index, its.fields))) for its in ones)) for names, ones in groups)
