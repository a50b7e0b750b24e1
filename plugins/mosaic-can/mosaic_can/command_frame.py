"""Makes the frames of one message of a DBC file: commands, and the safe one. Pure."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from typing import Any

import can
from cantools.database import EncodeError
from cantools.database.can import Message as Described

from mosaic_can.databases import invalid
from mosaic_can.signal_fields import bounds_of, command_field, field_names
from mosaic_core.contract.made_message import made_message
from mosaic_core.contract.params import Message
from mosaic_core.words.errors import hint_at
from mosaic_core.words.limits import MotionKind
from mosaic_core.words.safety_config import FieldBounds

SignalValue = float | bool | str


class CommandFrame:
    """Packs a command into a CAN frame. ``kinds``: what signals move. ``fixed``: what operators don't say, the same in
    every command. ``safe``: values of the safe frame beside 0 for each velocity. ``counter``: a signal that counts
    frames. Raises :class:`MosaicError` (``config.invalid``) for what the DBC file can't follow.
    """

    def __init__(
        self,
        described: Described,
        kinds: Mapping[str, MotionKind],
        fixed: Mapping[str, SignalValue],
        safe: Mapping[str, SignalValue],
        counter: str | None,
    ) -> None:
        self._described = described
        self._signals = {one.name: one for one in described.signals}
        if described.is_multiplexed() or described.is_container:
            raise invalid(f"{described.name} is multiplexed, and can't be commanded", "Name another message.")
        for name in (*kinds, *fixed, *safe, *([counter] if counter else ())):
            if name not in self._signals:
                raise invalid(f"{described.name} has no signal {name!r}{hint_at(name, self._signals)}",
                    f"It has: {', '.join(self._signals)}.")  # fmt: skip
        self._fixed = dict(fixed)
        self._counter = counter
        own = {*fixed, *([counter] if counter else ())}
        self.commanded = {name: field for name, field in field_names(self._signals).items() if name not in own}
        self.kinds = {name: kind for name, kind in kinds.items() if name in self.commanded}
        self._counts = self._counting()
        self._check_velocities()
        self._safe = self._safe_values(safe)

    def _counting(self) -> Iterator[int]:
        signal = self._signals.get(self._counter or "")
        if signal is None:
            return itertools.repeat(0)
        if signal.is_float or signal.is_signed or (signal.scale, signal.offset) != (1, 0):
            raise invalid(f"{signal.name} is no whole number from 0 on, and can't count", "Name another signal.")
        return itertools.cycle(range(1 << signal.length)) if signal.length <= 16 else itertools.count()

    def _check_velocities(self) -> None:
        for name, kind in self.kinds.items():
            low, high = bounds_of(self._signals[name]) or (0.0, 0.0)
            if self._signals[name].choices:
                raise invalid(f"{name} is one of some words, and moves nothing by a number", "Leave its kind out.")
            if kind == "velocity" and not low <= 0 <= high:
                cure = "Call it a position, or mend the range in the DBC file."
                raise invalid(f"{name} goes from {low:g} to {high:g}, and 0 must stand still", cure)

    def _safe_values(self, safe: Mapping[str, SignalValue]) -> dict[str, SignalValue] | None:
        if not self.kinds and not safe:
            return None
        zeros: dict[str, SignalValue] = {name: 0.0 for name, kind in self.kinds.items() if kind == "velocity"}
        values = {**self._fixed, **zeros, **safe}
        missing = [name for name in self._signals if name not in values and name != self._counter]
        if missing:
            raise invalid(f"the safe frame of {self._described.name} says nothing of {', '.join(missing)}",
                "Say it under safe: what is safe where nobody commands?")  # fmt: skip
        try:
            self._encoded(values, 0)
        except ValueError as error:
            raise invalid(f"safe: {error}", "Write a value that the DBC file allows.") from None
        return values

    @property
    def has_safe(self) -> bool:
        """Whether there is a safe frame."""
        return self._safe is not None

    @property
    def moves(self) -> bool:
        """Whether a command moves something."""
        return bool(self.kinds)

    def message(self) -> type[Message]:
        """What operators send."""
        fields = {
            field: command_field(self._signals[name], self.kinds.get(name)) for name, field in self.commanded.items()
        }
        return made_message("CanCommand", fields)

    def limits(self) -> dict[str, FieldBounds]:
        """The ranges of what moves."""
        found = {name: bounds_of(self._signals[name]) for name in self.kinds}
        return {
            self.commanded[name]: FieldBounds(min=its[0], max=its[1]) for name, its in found.items() if its is not None
        }

    def of(self, command: Mapping[str, Any]) -> can.Message:
        """The frame of a command. Raises :class:`ValueError` for what the DBC file does not allow."""
        values = {name: command[field] for name, field in self.commanded.items()}
        return self._encoded({**self._fixed, **values}, next(self._counts))

    def safe(self) -> can.Message:
        """The safe frame."""
        assert self._safe is not None
        return self._encoded(self._safe, next(self._counts))

    def _encoded(self, values: Mapping[str, SignalValue], count: int) -> can.Message:
        counted = {self._counter: count} if self._counter else {}
        told: dict[str, Any] = {name: _plain(value) for name, value in values.items()}
        try:
            data = self._described.encode({**told, **counted})
        except (EncodeError, KeyError) as error:
            raise ValueError(str(error)) from error
        return can.Message(
            arbitration_id=self._described.frame_id,
            is_extended_id=self._described.is_extended_frame,
            is_fd=self._described.is_fd or len(data) > 8,
            data=data,
        )


def _plain(value: SignalValue) -> float | str:
    """Flags as the numbers that cantools takes."""
    return int(value) if isinstance(value, bool) else value
