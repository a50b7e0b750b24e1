"""Follows a file that grows, is truncated, and is replaced by another one of its name."""

from __future__ import annotations

import os
import stat
from dataclasses import dataclass
from pathlib import Path

PIECE_BYTES = 65_536
MAX_BEHIND_BYTES = 1_048_576
"""A reader that far behind goes on at the end: what is read that late helps nobody."""
AWAY_S = 5.0
"""Between the renaming of a log and the first line of the next one; a file that is away for longer is gone."""


@dataclass(frozen=True, slots=True)
class FilePlace:
    """How far which file has been read."""

    device: int
    number: int
    offset: int


class GrowingFile:
    """Reads what is added to ``path``. :meth:`open` and :meth:`close` may follow each other: it goes on where it was;
    only the first time it starts at the end. One thread."""

    def __init__(self, path: str) -> None:
        self._path = path
        self._place: FilePlace | None = None
        self._fd = -1
        self._away_since_s: float | None = None
        self.skipped_bytes = 0
        """Left out because it was too far behind."""

    def open(self) -> None:
        """Raises :class:`OSError`."""
        self._away_since_s = None
        fd, found = self._opened()
        known = self._place
        if known is None:
            known = FilePlace(found.st_dev, found.st_ino, found.st_size)
        elif (known.device, known.number) != (found.st_dev, found.st_ino):
            known = FilePlace(found.st_dev, found.st_ino, 0)
        self._fd, self._place = fd, known

    def close(self) -> None:
        """Let the file go, and keep the place."""
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1

    def read(self, now_s: float) -> bytes:
        """The next piece; empty: nothing was added. Raises :class:`OSError` when the file is gone."""
        piece = self._piece()
        if not piece and self._is_replaced(now_s):
            piece = self._piece()  # what the writer added between the last look and the renaming
            if not piece:
                self.close()
                self.open()
                piece = self._piece()
        return piece

    def _piece(self) -> bytes:
        place = self._place
        assert place is not None, "read before open"
        size = os.fstat(self._fd).st_size
        offset = place.offset if place.offset <= size else 0  # truncated
        if size - offset > MAX_BEHIND_BYTES:
            self.skipped_bytes += size - PIECE_BYTES - offset
            offset = size - PIECE_BYTES
        piece = os.pread(self._fd, PIECE_BYTES, offset)
        self._place = FilePlace(place.device, place.number, offset + len(piece))
        return piece

    def _is_replaced(self, now_s: float) -> bool:
        place = self._place
        assert place is not None, "read before open"
        try:
            found = Path(self._path).stat()
        except FileNotFoundError:
            if self._away_since_s is None:
                self._away_since_s = now_s
            if now_s - self._away_since_s >= AWAY_S:
                raise
            return False
        self._away_since_s = None
        return (found.st_dev, found.st_ino) != (place.device, place.number)

    def _opened(self) -> tuple[int, os.stat_result]:
        fd = os.open(self._path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)  # a FIFO would wait for its writer
        found = os.fstat(fd)
        if not stat.S_ISREG(found.st_mode):
            os.close(fd)
            raise OSError(f"{self._path} is no file of lines")
        return fd, found
