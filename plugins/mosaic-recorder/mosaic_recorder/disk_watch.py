"""Looks after the disk while something is recorded: oldest files go, and the reserve stays free."""

from __future__ import annotations

import time
from collections.abc import Callable

from mosaic_recorder.folder import RecordingsFolder

PERIOD_S = 1.0


class DiskWatch:
    """Of one recording, on its thread. Raises :class:`OSError`."""

    def __init__(
        self, folder: RecordingsFolder, min_free_bytes: int, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._folder = folder
        self._min_free_bytes = min_free_bytes
        self._clock = clock
        self._due_at_s = clock()

    def check(self) -> str:
        """Why the recording must end, or nothing; looks once per :data:`PERIOD_S`, however often it is called."""
        if self._clock() < self._due_at_s:
            return ""
        self._due_at_s = self._clock() + PERIOD_S
        self._folder.tidy()
        return "recorder.disk_full" if self._folder.free_bytes() < self._min_free_bytes else ""
