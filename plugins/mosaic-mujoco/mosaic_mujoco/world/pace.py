"""Decides how many steps are due: so many that the simulation keeps pace with the clock, and no more than it can catch
up. Pure: no clock, no thread."""

from __future__ import annotations

from dataclasses import dataclass

MAX_CATCH_UP_S = 0.1
"""Of real time. After a longer stall it goes on from where it was instead of racing through the gap."""


@dataclass(slots=True)
class StepPace:
    """Says when a simulation takes its next step. ``speed``: seconds that are simulated per second; ``None``: as fast
    as it goes.
    """

    timestep_s: float
    speed: float | None = 1.0
    left_out_s: float = 0.0
    """Simulated time that was never simulated, because it fell behind."""
    _owed_s: float = 0.0

    def due(self, passed_s: float) -> int:
        """The steps to take now, after so much real time."""
        speed = 1.0 if self.speed is None else self.speed
        self._owed_s += passed_s * speed
        most_s = max(MAX_CATCH_UP_S * speed, self.timestep_s)
        if self._owed_s > most_s:
            self.left_out_s += self._owed_s - most_s
            self._owed_s = most_s
        steps = int(self._owed_s / self.timestep_s + 1e-9)
        self._owed_s = max(0.0, self._owed_s - steps * self.timestep_s)
        return steps

    def forget(self) -> None:
        """Nothing is due: it was paused."""
        self._owed_s = 0.0
