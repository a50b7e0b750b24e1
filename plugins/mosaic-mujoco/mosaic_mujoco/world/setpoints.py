"""Keeps the control signals of all actuators: what is set now, where it goes, how fast. Pure: no MuJoCo, no clock."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

Signals = NDArray[np.float64]

AT_ONCE = float("inf")


class Setpoints:
    """One signal for each actuator. A goal is approached at its own speed, so that a far one is no jump."""

    def __init__(self, count: int) -> None:
        self.now: Signals = np.zeros(count)
        self._goals: Signals = np.zeros(count)
        self._speeds: Signals = np.full(count, AT_ONCE)

    def settle(self, signals: Signals) -> None:
        """All signals are these from now on, and go nowhere."""
        self.now = signals.astype(np.float64)
        self._goals = self.now.copy()
        self._speeds[:] = AT_ONCE

    def aim(self, goals: Mapping[int, float], speeds: Mapping[int, float] | None = None) -> None:
        """Go there: in units of the signal per second, at once where no speed is said."""
        for number, goal in goals.items():
            self._goals[number] = goal
            self._speeds[number] = AT_ONCE if speeds is None else speeds.get(number, AT_ONCE)

    def stay(self, numbers: Iterable[int]) -> None:
        """Go no further."""
        for number in numbers:
            self._goals[number] = self.now[number]

    def advance(self, duration_s: float) -> Signals:
        """The signals after so much more time."""
        with np.errstate(invalid="ignore"):
            furthest = self._speeds * duration_s
        self.now = self.now + np.clip(self._goals - self.now, -furthest, furthest)
        return self.now
