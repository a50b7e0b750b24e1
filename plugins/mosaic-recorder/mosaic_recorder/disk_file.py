"""A file on a disk that may be slow, full or broken: what was written whole before a failure stays."""

from __future__ import annotations

import os
import time
from pathlib import Path

from mosaic_recorder.folder import new_file

SYNC_S = 1.0
"""How often the disk is told to write what the system holds in memory: a power cut costs about this much."""


class DiskFile:
    """One file of a recording as its container's library sees it. Unbuffered: what that has flushed survives the end of
    this process. Nothing more is written after a failure: what follows a hole can't be read."""

    def __init__(self, path: Path) -> None:
        self._file = new_file(path, buffering=0)
        self._synced_at_s = time.monotonic()
        self._whole_bytes = 0
        self.failure: OSError | None = None
        """libav only passes on that something failed."""

    def write(self, data: bytes) -> int:
        """All of ``data``: one call may take less when the disk is nearly full, and the next one says why."""
        if self.failure is not None:
            raise self.failure
        view = memoryview(data)
        try:
            while view:
                view = view[self._file.write(view) :]
        except OSError as error:
            self.failure = error
            raise
        return len(data)

    def seek(self, offset: int, whence: int = 0) -> int:
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        return self._file.tell()

    def flush(self) -> None:
        """Nothing is held back."""

    def mark_whole(self) -> None:
        """What is in the file can be read as it is; after a failure the rest is cut off."""
        if self.failure is None:
            self._whole_bytes = self._file.seek(0, os.SEEK_END)

    def sync_now_and_then(self) -> None:
        if time.monotonic() - self._synced_at_s >= SYNC_S:
            self._sync()
            self._synced_at_s = time.monotonic()  # after it: a slow disk gets time to breathe

    def _sync(self) -> None:
        try:
            os.fsync(self._file.fileno())
        except OSError as error:
            self.failure = error
            raise

    def close(self) -> None:
        try:
            if self.failure is None:
                self._sync()
            else:
                self._file.truncate(self._whole_bytes)
        finally:
            self._file.close()
