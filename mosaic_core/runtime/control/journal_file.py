"""The journal as a file of JSON lines, written on a thread of its own so that a slow disk delays no command."""

from __future__ import annotations

import contextlib
import logging
import os
import queue
from io import TextIOWrapper
from logging.handlers import QueueListener, RotatingFileHandler
from pathlib import Path
from typing import cast

from mosaic_core.words.control import JournalEntry
from mosaic_core.words.wire_model import to_json

logger = logging.getLogger(__name__)

MAX_BYTES = 5 * 1024 * 1024
KEPT_FILES = 3
MAX_WAITING = 1000
"""Entries for a disk that stands still; later ones are only in memory."""


class _PrivateFile(RotatingFileHandler):
    """Names of operators are in it: nobody but its owner reads it."""

    def _open(self) -> TextIOWrapper:
        def opener(path: str, flags: int) -> int:
            return os.open(path, flags, 0o600)

        return cast(TextIOWrapper, open(self.baseFilename, self.mode, encoding=self.encoding, opener=opener))

    def handleError(self, record: logging.LogRecord) -> None:
        logger.error("the journal can't be written to %s", self.baseFilename, exc_info=True)


class JournalFile:
    """``write`` never blocks. A file that can't be opened is told in the log, and the robot goes on without it."""

    def __init__(self, path: str | Path) -> None:
        self._waiting: queue.Queue[logging.LogRecord] = queue.Queue(MAX_WAITING)
        self._listener: QueueListener | None = None
        try:
            file = _PrivateFile(path, maxBytes=MAX_BYTES, backupCount=KEPT_FILES, encoding="utf-8")
        except OSError as error:
            logger.error("the journal can't be written to %s: %s", path, error)
            return
        self._file = file
        self._listener = QueueListener(self._waiting, file)
        self._listener.start()

    def write(self, entry: JournalEntry) -> None:
        if self._listener is not None:
            text = to_json(entry.wire())
            record = logging.LogRecord("journal", logging.INFO, "", 0, "%s", (text,), None)
            with contextlib.suppress(queue.Full):
                self._waiting.put_nowait(record)

    def close(self) -> None:
        """Write what waits, at most as much as there is."""
        if self._listener is not None:
            with contextlib.suppress(queue.Full):
                self._listener.stop()
            self._file.close()
