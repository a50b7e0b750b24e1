"""The offset between two monotonic clocks, from four-stamp pings (RFC 5905 §8) with a minimum-round-trip filter.

A queue on the way only ever lengthens a round trip, so the shortest of the last ones tells the offset best; it is
wrong by half its round trip at most.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

WINDOW = 20
"""Ten seconds of pings: long enough to meet a quiet moment, short enough to follow drifting crystals (1 ms)."""


@dataclass(frozen=True, slots=True)
class ClockSample:
    """One measurement of another clock. ``offset_us``: what to add to our clock to read the other one.
    ``round_trip_us``: without their thinking.
    """

    offset_us: int
    round_trip_us: int


class ClockOffset:
    """Collects samples. Reset it when the other side's ``boot_id`` changes: its clock started anew."""

    def __init__(self, window: int = WINDOW) -> None:
        self._samples: deque[ClockSample] = deque(maxlen=window)

    def add(self, t0_us: int, t1_us: int, t2_us: int, t3_us: int) -> ClockSample | None:
        """Our sending, their receipt, their sending, our receipt; ``None`` for stamps that can't be."""
        round_trip_us = (t3_us - t0_us) - (t2_us - t1_us)
        if t3_us < t0_us or t2_us < t1_us or round_trip_us < 0:
            return None
        sample = ClockSample(((t1_us - t0_us) + (t2_us - t3_us)) // 2, round_trip_us)
        self._samples.append(sample)
        return sample

    @property
    def best(self) -> ClockSample | None:
        """The sample with the shortest round trip in the window."""
        return min(self._samples, key=lambda sample: sample.round_trip_us, default=None)

    @property
    def round_trip_us(self) -> int | None:
        """The latest round trip."""
        return self._samples[-1].round_trip_us if self._samples else None

    def to_theirs_us(self, ours_us: int) -> int | None:
        """Our time on their clock."""
        return None if self.best is None else ours_us + self.best.offset_us

    def to_ours_us(self, theirs_us: int) -> int | None:
        """Their time on our clock."""
        return None if self.best is None else theirs_us - self.best.offset_us

    def reset(self) -> None:
        self._samples.clear()
