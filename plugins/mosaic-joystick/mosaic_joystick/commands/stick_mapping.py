"""Which axes of a stick drive, and which button must be held. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

from mosaic_core.messages import STANDSTILL, Twist
from mosaic_core.words.errors import MosaicError, hint_at
from mosaic_joystick.input_codes import StickKind
from mosaic_joystick.stick_state import Stick, StickReading

USUAL: dict[StickKind, tuple[str, str, str]] = {
    "gamepad": ("y", "x", "left_bumper"),
    "joystick": ("y", "rz", "trigger"),
    "3D mouse": ("y", "rz", "button_00"),
}
"""Axis ahead, axis that turns, and the button that must be held."""


@dataclass(frozen=True, slots=True)
class Wishes:
    """What somebody has said; an empty name: what is usual for this kind of stick."""

    ahead: str = ""
    turn: str = ""
    left: str = ""
    dead_man: str = ""
    linear_mps: float = 0.3
    angular_radps: float = 0.8


@dataclass(frozen=True, slots=True)
class StickMapping:
    """Places of axes and of the button. ``left``: only where it shall also move sideways."""

    ahead: int
    turn: int
    left: int | None
    dead_man: int
    linear_mps: float
    angular_radps: float

    @classmethod
    def of(cls, stick: Stick, wishes: Wishes) -> Self:
        """Raises :class:`MosaicError` that names what the stick has where it has not what is wished."""
        axes, buttons = [axis.name for axis in stick.axes], list(stick.buttons.values())
        ahead, turn, dead_man = USUAL[stick.kind]
        if turn not in axes:
            turn = "x"
        if dead_man not in buttons and buttons:
            dead_man = buttons[0]
        return cls(
            ahead=_place("axis", wishes.ahead or ahead, axes, stick),
            turn=_place("axis", wishes.turn or turn, axes, stick),
            left=_place("axis", wishes.left, axes, stick) if wishes.left else None,
            dead_man=_place("button", wishes.dead_man or dead_man, buttons, stick),
            linear_mps=wishes.linear_mps,
            angular_radps=wishes.angular_radps,
        )

    def is_held(self, reading: StickReading) -> bool:
        """Whether somebody's thumb is on the stick."""
        return reading.buttons[self.dead_man]

    def twist(self, reading: StickReading) -> Twist:
        """What the base shall do; it stands where the button is not held."""
        if not self.is_held(reading):
            return STANDSTILL
        return Twist.planar(
            reading.axes[self.ahead] * self.linear_mps,
            0.0 if self.left is None else reading.axes[self.left] * self.linear_mps,
            reading.axes[self.turn] * self.angular_radps,
        )


def _place(what: str, name: str, known: list[str], stick: Stick) -> int:
    if name in known:
        return known.index(name)
    cure = f"It has: {', '.join(known) or 'none'}."
    raise MosaicError(f"'{stick.name}' has no {what} '{name}'{hint_at(name, known)} {cure}",
                      code="config.invalid", cure=cure)  # fmt: skip
