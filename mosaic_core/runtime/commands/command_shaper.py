"""Shapes a payload into what ``handle_data`` gets: parsed, slowed, limited, then validated as the handler's ``T``."""

from __future__ import annotations

import copy
import time
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from mosaic_core.contract.handler import DataChannelReceivable, Refused, message_type_of
from mosaic_core.contract.message_schema import nodes_on
from mosaic_core.machines.commands.gates import WrongShape
from mosaic_core.machines.commands.number_list import NumberList
from mosaic_core.machines.commands.safety_envelope import EnvelopeState, SafetyEnvelope
from mosaic_core.runtime.commands.payload import PayloadReader
from mosaic_core.runtime.commands.reported_position import ReportedPosition
from mosaic_core.runtime.commands.unsaid_bounds import UnsaidBounds
from mosaic_core.runtime.commands.whole_numbers import WholeNumbers
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety


@dataclass(frozen=True, slots=True)
class ShapedCommand:
    """A command that may act, clamped and slewed. ``fired``: how many safe actions had been set going when it was
    shaped. ``wants_motion``: it asks for motion, or nobody can say."""

    value: Any
    is_idle: bool
    fired: int
    wants_motion: bool = True


class CommandShaper:
    """Shapes the commands of one receiver, on its one thread or task.

    ``fired`` counts the safe actions: after one, speeds rise from zero again, and positions start where they are.
    """

    def __init__(
        self,
        handler: DataChannelReceivable[Any],
        safety: ReceiverSafety,
        fired: Callable[[], int],
        now_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self._reader = PayloadReader(handler)
        self._envelope = _envelope_of(handler, safety) if safety.has_fields else None
        self._defaults: MotionDefaults | None = None
        if self._envelope is not None:
            its = self._reader.schema(), self._envelope.fields, self._envelope.positions
            self._defaults, self._whole = MotionDefaults(*its, safety.lists), WholeNumbers(*its, safety)
        self._bounds = UnsaidBounds(message_type_of(type(handler)), safety.limits)
        self._fired = fired
        self._shaped_after = fired()
        self._now_s = now_s
        self._before: EnvelopeState | None = None
        self._last: dict[str, Any] | None = None
        self._last_before: dict[str, Any] | None = None

    def parsed(self, payload: bytes) -> Any:
        """What the bytes say, with what moves by default; where nothing limits it, as the handler takes it. Raises
        what :meth:`limited` raises."""
        value = self._reader.parsed(payload)
        if self._defaults is None:
            return self._reader.validated(value)
        if not isinstance(value, dict):
            raise Refused("channel.invalid", "a JSON object is wanted")
        self._defaults.complete(value)
        return value

    def limited(self, value: Any, factor: float) -> ShapedCommand:
        """What :meth:`parsed` gave, as it may act now with ``factor`` of its speed; raises :class:`Refused`, or
        whatever a validator of the plugin raises.

        Say :meth:`undone` if it does not act after all.
        """
        fired = self._fired()
        if self._envelope is None:
            return ShapedCommand(value, False, fired)
        if fired != self._shaped_after:
            self._envelope.stand_still()
            self._shaped_after = fired
        self._before, self._last_before = self._envelope.state, self._last
        try:
            shaped = self._envelope.shaped(value, factor, self._now_s())
            taken = self._validated(self._whole.made_of(shaped.message, value), value)
            command = ShapedCommand(taken, shaped.is_idle, fired, shaped.wants_motion)
        except BaseException:
            self.undone()
            raise
        self._last = shaped.message
        return command

    def _validated(self, message: dict[str, Any], value: dict[str, Any]) -> Any:
        """``message``, which the limits made of ``value``, as the handler takes it."""
        try:
            return self._reader.validated(self._bounds.said(message))
        except Refused:
            try:  # only now: what the limits bring within the bounds of the handler's type is taken
                self._reader.validated(value)
            except Refused as refused:
                raise WrongShape(refused.code, refused.message) from None
            raise

    def undone(self) -> None:
        """The command was refused: the next one starts where the last one ended."""
        if self._envelope is not None and self._before is not None:
            self._envelope.restore(self._before)
            self._last = self._last_before

    def zeros(self) -> Any:
        """The last command with all motion at zero, as the handler takes it; ``None``: there is nothing to repeat."""
        if self._envelope is None or self._last is None:
            return None
        return self._reader.validated(self._bounds.said(self._envelope.zero(self._last)))


def _envelope_of(handler: DataChannelReceivable[Any], safety: ReceiverSafety) -> SafetyEnvelope:
    fields, report = (safety.motion_fields, safety.position_fields), ReportedPosition(handler, safety)
    return SafetyEnvelope(safety.limits, *fields, lists=safety.lists, report=report)


class MotionDefaults:
    """Completes the messages of one receiver by what it would take for motion fields that they leave out, if that
    moves: else a message without the field would move by a default that no limit has seen. ``schema``: the JSON Schema
    of its messages; ``fields``: dotted paths of velocities, ``positions``: those of positions, which any number moves.
    ``lists``: where positions stand in lists; those move by any number in them, whatever names them.
    """

    def __init__(
        self,
        schema: Mapping[str, Any],
        fields: Iterable[str],
        positions: Collection[str] = (),
        lists: Iterable[NumberList] = (),
    ) -> None:
        found: dict[tuple[str, ...], Any] = {}
        in_lists = [path for one in lists for path in (one.path, one.names) if path]
        for field in (*fields, *positions, *in_lists):
            path = tuple(field.split("."))
            for place, node in enumerate(nodes_on(schema, path), 1):
                default = node.get("default")
                if _moves(default, path[place:], is_position=field in positions, is_list=field in in_lists):
                    found[path[:place]] = default
        self._found = tuple(sorted(found.items(), key=lambda item: len(item[0])))

    def complete(self, message: dict[str, Any]) -> None:
        """Add to ``message`` what it leaves out and what moves."""
        for path, default in self._found:
            inner: Any = message
            for key in path[:-1]:
                inner = inner.get(key) if isinstance(inner, dict) else None
            if isinstance(inner, dict) and path[-1] not in inner:
                inner[path[-1]] = copy.deepcopy(default)


def _moves(default: Any, path: Iterable[str], *, is_position: bool, is_list: bool) -> bool:
    for key in path:
        default = default.get(key) if isinstance(default, dict) else None
    if is_list:
        return isinstance(default, list) and bool(default)
    return isinstance(default, int | float) and not isinstance(default, bool) and (is_position or default != 0)
