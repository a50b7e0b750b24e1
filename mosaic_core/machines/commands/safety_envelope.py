"""Limits a command before it acts: clamps, then scales, then slews it, so no plugin sees more than is allowed.

Works on the parsed JSON message: a dict of dicts with numbers, addressed by dotted paths. A field that is missing
counts as 0 and stays missing, but for one that has not fallen to 0 yet: leaving it out stops no faster. Rates hold
between what was put out before and what is put out now: towards zero for the whole time between two commands, away from
zero for at most :data:`MAX_RISE_STEP_S`, so that a pause saves up no jump.

All that is of velocities. Position fields go their own way (:mod:`.position_slew`): 0 is a place like any other to
them, a missing one stays where it is, and the factor scales their rate. Positions may stand in lists
(:mod:`.number_list`).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias

from mosaic_core.machines.commands.message_numbers import HUGE, OutOfRange, number_at, put
from mosaic_core.machines.commands.number_list import NumberList
from mosaic_core.machines.commands.position_slew import HeldPositions, PositionSlew, ReportPosition
from mosaic_core.machines.commands.slew import MAX_RISE_STEP_S, clamped, reach
from mosaic_core.words.limits import FieldLimit

__all__ = ["IDLE_AFTER_S", "MAX_RISE_STEP_S", "OutOfRange", "SafetyEnvelope", "Shaped"]

IDLE_AFTER_S = 1.0
"""Zeros are handed on for this long; then the operator rests and must not block an autonomy that drives meanwhile."""
InList: TypeAlias = tuple[NumberList, Mapping[str, float]]


@dataclass(frozen=True, slots=True)
class Shaped:
    """The command that may act, after the safety envelope. ``is_zero``: every velocity is 0, and there is one.
    ``is_idle``: it has been for a second and nothing else has changed: accept it, but don't hand it over, and disarm
    the watchdog. ``was_limited``: it differs from the wish. ``wants_motion``: some velocity of the wish isn't 0,
    whatever is left of it, or it names a position."""

    message: dict[str, Any]
    is_zero: bool
    is_idle: bool
    was_limited: bool
    wants_motion: bool


@dataclass(frozen=True, slots=True)
class EnvelopeState:
    """The command that was put out last, for :meth:`SafetyEnvelope.restore`."""

    output: tuple[float, ...]
    at_s: float | None
    zero_since_s: float | None
    standing: Mapping[str, Any] | None
    held: HeldPositions = field(default_factory=dict)


class SafetyEnvelope:
    """The envelope of one receiver. Shape a command when it is handed over, not when it is queued. Not thread-safe."""

    def __init__(
        self,
        limits: Iterable[FieldLimit] = (),
        motion_fields: Iterable[str] = (),
        position_fields: Iterable[str] = (),
        *,
        lists: Iterable[NumberList] = (),
        report: ReportPosition = lambda name: None,
        idle_after_s: float = IDLE_AFTER_S,
    ) -> None:
        self.limits = tuple(limits)
        paces = [limit for limit in self.limits if limit.kind == "velocity"]
        places = [limit for limit in self.limits if limit.kind == "position"]
        self.positions = tuple(dict.fromkeys((*position_fields, *(name for one in places for name in one.fields))))
        """Position fields: their rate is scaled and limited."""
        self.fields = tuple(dict.fromkeys((*motion_fields, *(name for one in paces for name in one.fields))))
        """Velocities: everything that is scaled, limited and set to zero."""
        self._lists = tuple(lists)
        alone = [name for name in self.positions if not any(one.holds(name) for one in self._lists)]
        self._position_paths = tuple((name, tuple(name.split("."))) for name in alone)
        self._slew = PositionSlew(self.positions, places, report, self._lists)
        self._paths = tuple(tuple(name.split(".")) for name in self.fields)
        place = {name: at for at, name in enumerate(self.fields)}
        self._limits = tuple((limit, tuple(place[name] for name in limit.fields)) for limit in paces)
        self._groups = _groups(self._limits)
        self._idle_after_s = idle_after_s
        self._state = EnvelopeState((0.0,) * len(self.fields), None, None, None)

    @property
    def state(self) -> EnvelopeState:
        return self._state

    def restore(self, state: EnvelopeState) -> None:
        """The command was refused after all: the base does what it did before."""
        self._state = state

    def stand_still(self) -> None:
        """A safe action has run. Whatever comes next starts velocities from zero, and like a first command acts at
        once; positions start where they are then."""
        held = {name: replace(one, is_sure=False) for name, one in self._state.held.items()}
        self._state = EnvelopeState((0.0,) * len(self.fields), None, None, None, held)

    def shaped(self, message: Mapping[str, Any], factor: float, now_s: float) -> Shaped:
        """``message`` as it may act now, with ``factor`` (0 to 1) of its speed. Raises :class:`OutOfRange`, or what
        :meth:`PositionSlew.moved` raises."""
        wish = [number_at(message, path, name) for path, name in zip(self._paths, self.fields, strict=True)]
        in_lists = [(one, one.read(message)) for one in self._lists]
        goals = self._goals(message, in_lists)
        share = factor if 0.0 <= factor <= 1.0 else 0.0  # NaN too: what is unknown doesn't move
        target = [0.0 if value is None else max(-HUGE, min(HUGE, value)) for value in wish]
        for limit, places in self._limits:
            clamped(target, limit, places)
        # a share of what is allowed: of a wish beyond the limits it would leave the limits themselves
        output = self._slewed([value * share for value in target], now_s)
        sent = self._slew.moved(goals, self._state.held, share, now_s)
        shaped, was_limited = dict(message), False
        for path, value, wished in zip(self._paths, output, (value or 0.0 for value in wish), strict=True):
            if value != wished:  # what isn't limited stays the number it was, also an integer
                was_limited = True
                put(shaped, message, path, value)
        was_limited = self._placed(shaped, message, goals, sent, in_lists) or was_limited
        is_zero = not any(output) and any(value is not None for value in wish)
        is_idle = self._note(output, sent, shaped, is_zero, now_s)
        return Shaped(shaped, is_zero, is_idle, was_limited, any(wish) or bool(goals))

    def _placed(
        self,
        shaped: dict[str, Any],
        message: Mapping[str, Any],
        goals: Mapping[str, float],
        sent: Mapping[str, float],
        in_lists: Iterable[InList],
    ) -> bool:
        """Write the positions that are not as they were wished; whether there are any."""
        changed = {name: value for name, value in sent.items() if value != goals[name]}
        for name, path in self._position_paths:
            if name in changed:
                put(shaped, message, path, sent[name])
        for one, items in in_lists:
            if not changed.keys().isdisjoint(items):
                one.write(shaped, message, [changed.get(name) for name in items])
        return bool(changed)

    def _goals(self, message: Mapping[str, Any], in_lists: Iterable[InList]) -> dict[str, float]:
        """The positions that ``message`` names."""
        said = [(name, number_at(message, path, name)) for name, path in self._position_paths]
        said += [item for _, items in in_lists for item in items.items()]
        return {name: max(-HUGE, min(HUGE, value)) for name, value in said if value is not None}

    def zero(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """``message`` with every velocity at 0, for receivers that are told to stand by a command."""
        shaped = dict(message)
        for path, name in zip(self._paths, self.fields, strict=True):
            if number_at(message, path, name) is not None:
                put(shaped, message, path, 0.0)
        return shaped

    def _slewed(self, target: list[float], now_s: float) -> list[float]:
        if not self._groups:
            return [value + 0.0 for value in target]
        state = self._state
        elapsed_s = MAX_RISE_STEP_S if state.at_s is None else max(0.0, now_s - state.at_s)
        last, output = state.output, list(target)
        for places, limits in self._groups:
            part = min(reach(last, target, limit, its, elapsed_s) for limit, its in limits)
            if part < 1.0:
                for at in places:
                    output[at] = last[at] + part * (target[at] - last[at])
                for limit, its in limits:
                    clamped(output, limit, its)  # rounding must not leave the limits
        return [value + 0.0 for value in output]  # -0.0 becomes 0.0

    def _note(
        self, output: list[float], sent: Mapping[str, float], shaped: dict[str, Any], is_zero: bool, now_s: float
    ) -> bool:
        """Remember what is put out; whether it is idle."""
        before = self._state
        at_s = now_s if before.at_s is None else max(before.at_s, now_s)
        held = self._slew.remembered(before.held, sent, at_s)
        if not is_zero:
            self._state = EnvelopeState(tuple(output), at_s, None, None, held)
            return False
        since_s = before.zero_since_s
        if since_s is None or shaped != before.standing:
            since_s = now_s if since_s is None else since_s
            self._state = EnvelopeState(tuple(output), at_s, since_s, shaped, held)
            return False
        self._state = EnvelopeState(tuple(output), at_s, since_s, before.standing, held)
        return now_s - since_s >= self._idle_after_s


LimitedFields = tuple[tuple[int, ...], tuple[tuple[FieldLimit, tuple[int, ...]], ...]]


def _groups(limits: Iterable[tuple[FieldLimit, tuple[int, ...]]]) -> tuple[LimitedFields, ...]:
    """Limits that share a field move together, and only as far as the slowest of them allows; those without a rate
    that share none need no slewing."""
    groups: list[tuple[set[int], list[tuple[FieldLimit, tuple[int, ...]]]]] = []
    for limit, places in limits:
        joined, its = set(places), [(limit, places)]
        for other in [group for group in groups if group[0] & joined]:
            groups.remove(other)
            joined |= other[0]
            its = [*other[1], *its]
        groups.append((joined, its))
    has_rate = [group for group in groups if any(_has_rate(limit) for limit, _ in group[1])]
    return tuple((tuple(sorted(places)), tuple(its)) for places, its in has_rate)


def _has_rate(limit: FieldLimit) -> bool:
    return limit.max_rise_per_s is not None or limit.max_fall_per_s is not None
