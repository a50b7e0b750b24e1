"""Looks after the disk while something is recorded: oldest files go, and the reserve stays free."""

from __future__ import annotations

import errno
import time
from collections.abc import Callable

from mosaic_recorder.folder import RecordingsFolder

PERIOD_S = 1.0
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""No space, no quota, or more than the file system takes in one file."""


class DiskWatch:
    """Watches the disk for one recording, on its thread. Raises :class:`OSError`."""

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


def code_of(error: OSError) -> str:
    """The reason code of an error of the disk: ``recorder.disk_full`` or ``recorder.write_failed``."""
    return "recorder.disk_full" if error.errno in _FULL else "recorder.write_failed"
