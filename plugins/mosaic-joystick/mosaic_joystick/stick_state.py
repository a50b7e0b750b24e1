"""How a stick stands, by what its kernel has told of it so far. Pure: ``now`` is an argument."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from mosaic_joystick.axis import REL_HOLDS_S, Axis
from mosaic_joystick.input_codes import ABS, KEY, REL, StickKind


@dataclass(frozen=True, slots=True)
class InputEvent:
    """One event of the kernel."""

    kind: int
    code: int
    value: int


@dataclass(frozen=True, slots=True)
class Stick:
    """What a stick is and has. ``buttons``: code → name."""

    name: str
    path: str
    kind: StickKind
    axes: tuple[Axis, ...]
    buttons: dict[int, str]


@dataclass(frozen=True, slots=True)
class StickReading:
    """The axes' shares and whether buttons are pressed, in the order of the stick."""

    axes: tuple[float, ...]
    buttons: tuple[bool, ...]


class StickState:
    """Keeps the newest value of each axis and button."""

    def __init__(self, stick: Stick, dead_zone: float) -> None:
        self.stick = stick
        self._dead_zone = dead_zone
        self._pressed: set[int] = set()
        self._values: dict[tuple[int, int], tuple[int, float]] = {}

    def take(self, events: Iterable[InputEvent], now_s: float) -> None:
        """Take what has happened until ``now_s``."""
        for event in events:
            if event.kind == KEY:
                (self._pressed.add if event.value else self._pressed.discard)(event.code)
            elif event.kind in (ABS, REL):
                self._values[event.kind, event.code] = (event.value, now_s)

    def reading(self, now_s: float) -> StickReading:
        """How it stands."""
        return StickReading(
            tuple(self._share(axis, now_s) for axis in self.stick.axes),
            tuple(code in self._pressed for code in self.stick.buttons),
        )

    def _share(self, axis: Axis, now_s: float) -> float:
        """An axis that never told anything is let go: the kernel tells how all stand when the stick is opened."""
        found = self._values.get((REL if axis.is_relative else ABS, axis.code))
        if found is None or (axis.is_relative and now_s - found[1] > REL_HOLDS_S):
            return 0.0
        return axis.share(found[0], self._dead_zone)
