"""The time line of a recording: capture times from zero on, always rising, with the pauses cut out."""

from __future__ import annotations

from collections import deque
from statistics import median

LEAST_STEP_S = 0.001
"""Matroska counts in milliseconds: two pictures within the same one would share a time stamp."""
USUAL_STEP_S = 1 / 30
"""How long a picture is shown while nothing is known of the rate."""
STEPS = 5
"""Distances between pictures that tell what is usual now."""


class Timeline:
    """One recording's time line. A gap in the pictures stays a gap; :meth:`cut` removes the one that comes next."""

    def __init__(self) -> None:
        self._zero_s: float | None = None
        self._at_s: float | None = None
        self._steps_s: deque[float] = deque(maxlen=STEPS)

    def peek(self, captured_at_s: float) -> float:
        """Where :meth:`place` would put the picture of ``captured_at_s``."""
        if self._at_s is None:
            return 0.0
        if self._zero_s is None:  # the first one after a cut follows as if nothing had been in between
            return self._at_s + _usual_s(self._steps_s)
        return max(captured_at_s - self._zero_s, self._at_s + LEAST_STEP_S)

    def place(self, captured_at_s: float) -> float:
        """Where the picture of ``captured_at_s`` belongs, in seconds; later than all before."""
        at_s = self.peek(captured_at_s)
        if self._zero_s is None:
            self._zero_s = captured_at_s - at_s
        else:
            assert self._at_s is not None
            self._steps_s.append(at_s - self._at_s)
        self._at_s = at_s
        return at_s

    def cut(self) -> None:
        """Leave out the time from the last picture to the next one."""
        self._zero_s = None

    @property
    def is_cut(self) -> bool:
        """The next picture is the first, or the first after a cut."""
        return self._zero_s is None

    @property
    def end_s(self) -> float:
        """The end of the last picture, shown as long as is usual; 0 before the first."""
        return 0.0 if self._at_s is None else self._at_s + _usual_s(self._steps_s)

    def end_with(self, captured_at_s: float) -> float:
        """What :attr:`end_s` would be after :meth:`place`."""
        at_s, steps_s = self.peek(captured_at_s), self._steps_s
        if self._zero_s is not None and self._at_s is not None:
            steps_s = deque((*steps_s, at_s - self._at_s), maxlen=STEPS)
        return at_s + _usual_s(steps_s)


def _usual_s(steps_s: deque[float]) -> float:
    """The median: one gap or hiccup does not count."""
    return median(steps_s) if steps_s else USUAL_STEP_S
