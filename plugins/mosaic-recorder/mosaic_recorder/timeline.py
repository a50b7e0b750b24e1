"""The time line of a recording: capture times from zero on, always rising, with the pauses cut out."""

from __future__ import annotations

LEAST_STEP_S = 0.001
"""Matroska counts in milliseconds: two pictures within the same one would share a time stamp."""
USUAL_STEP_S = 1 / 30
"""How long a picture is shown while nothing is known of the rate."""


class Timeline:
    """Of one recording. A gap in the pictures stays a gap; :meth:`cut` removes the one that comes next."""

    def __init__(self) -> None:
        self._zero_s: float | None = None
        self._at_s: float | None = None
        self.step_s = USUAL_STEP_S
        """The last distance between two pictures: for how long the last one is shown."""

    def peek(self, captured_at_s: float) -> float:
        """Where :meth:`place` would put the picture of ``captured_at_s``."""
        if self._at_s is None:
            return 0.0
        if self._zero_s is None:  # the first one after a cut follows as if nothing had been in between
            return self._at_s + self.step_s
        return max(captured_at_s - self._zero_s, self._at_s + LEAST_STEP_S)

    def place(self, captured_at_s: float) -> float:
        """Where the picture of ``captured_at_s`` belongs, in seconds; later than all before."""
        at_s = self.peek(captured_at_s)
        if self._zero_s is None:
            self._zero_s = captured_at_s - at_s
        else:
            assert self._at_s is not None
            self.step_s = at_s - self._at_s
        self._at_s = at_s
        return at_s

    def cut(self) -> None:
        """Leave out the time from the last picture to the next one."""
        self._zero_s = None

    @property
    def end_s(self) -> float:
        """The end of the last picture; 0 before the first."""
        return 0.0 if self._at_s is None else self._at_s + self.step_s
