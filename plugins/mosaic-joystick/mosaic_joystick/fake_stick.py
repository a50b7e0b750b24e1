"""A stick that is made up: it is moved round and round, and its trigger is pressed every other second."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from mosaic_joystick.axis import Axis
from mosaic_joystick.input_codes import ABS, KEY, button_name
from mosaic_joystick.stick_state import InputEvent, Stick

FULL = 1000
ROUND_S = 4.0
TRIGGER, THUMB = 0x120, 0x121


class FakeStick:
    """Plays an input device."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock

    def stick(self) -> Stick:
        axes = (Axis(0x00, "x", -FULL, FULL), Axis(0x01, "y", -FULL, FULL), Axis(0x05, "rz", -FULL, FULL))
        return Stick("a stick that is made up", "fake", "joystick", axes,
                     {code: button_name(code) for code in (TRIGGER, THUMB)})  # fmt: skip

    def standing(self) -> list[InputEvent]:
        return self.events()

    def events(self) -> list[InputEvent]:
        """How it stands now."""
        now_s = self._clock()
        angle_rad = 2 * math.pi * now_s / ROUND_S
        return [
            InputEvent(ABS, 0x00, round(-FULL * math.sin(angle_rad))),
            InputEvent(ABS, 0x01, round(-FULL * math.cos(angle_rad))),
            InputEvent(KEY, TRIGGER, int(now_s) % 2),
        ]
