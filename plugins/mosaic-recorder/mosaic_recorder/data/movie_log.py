"""Where the pictures of a recorder's movies belong in time: what aligns them with the data beside them."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

MAX_STRETCHES = 1000
"""As many may wait for a recording of data; each is a pause or a file."""


@dataclass(frozen=True, slots=True)
class MovieStretch:
    """Pictures of a movie without a cut between them. ``at_s``: where the first lies in ``file``;
    ``captured_at_s``: when it was captured, on the robot's monotonic clock."""

    label: str
    file: str
    at_s: float
    captured_at_s: float


class MovieLog:
    """Keeps the newest stretches of all cameras of one recorder. Any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._stretches: deque[tuple[int, MovieStretch]] = deque(maxlen=MAX_STRETCHES)
        self._number = 0

    def add(self, stretch: MovieStretch) -> None:
        with self._lock:
            self._number += 1
            self._stretches.append((self._number, stretch))

    def reader(self, is_open: Callable[[str], bool]) -> Callable[[], list[MovieStretch]]:
        """Gives, call by call, what is new; at first what lies in files that are still open."""
        seen = 0

        def news() -> list[MovieStretch]:
            nonlocal seen
            with self._lock:
                is_first, found = not seen, [(number, one) for number, one in self._stretches if number > seen]
                seen = self._number
            return [one for _, one in found if not is_first or is_open(one.file)]

        return news
