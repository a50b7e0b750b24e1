"""Plays a recording at its own pace. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import time
from typing import Any

UNTIMED_EPOCH_S = 1.0
"""A receiver without a fix has no time either, and speaks once a second."""
MAX_GAP_S = 5.0
"""A gap in a recording is not waited out; this also bounds a time that jumps back."""
DAY_S = 86_400.0


@dataclass(slots=True)
class Pace:
    """Computes how long to wait before a recorded sentence, so that a file plays at the pace of its recording."""

    _before: time | None = None

    def wait_s(self, sentence: Any | None) -> float:
        """Seconds since the sentence before; 0 within an epoch and for sentences without a time."""
        clock = getattr(sentence, "time", None)
        if not isinstance(clock, time):
            return UNTIMED_EPOCH_S if getattr(sentence, "msgID", "") == "GGA" else 0.0
        before, self._before = self._before, clock
        if before is None:
            return 0.0
        return min((_seconds(clock) - _seconds(before)) % DAY_S, MAX_GAP_S)


def _seconds(clock: time) -> float:
    return clock.hour * 3600 + clock.minute * 60 + clock.second + clock.microsecond / 1e6
