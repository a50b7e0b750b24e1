"""The open line between its two users: the sender's body opens and reads it, the receiver writes commands to it.

Three threads meet here: the *body's* opens, reads and closes, the *receiver's* writes, the robot's *safety* thread
writes the safe line. A line that is opened begins with the safe line, and one that is closed ends with it: a controller
may still carry out what a crashed program told it.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from mosaic_core.words.errors import Refused
from mosaic_sensors.byte_source import ByteSource

SILENCE_S = 0.5
"""Without a command for so long, what moves is told to stand still."""


class LineLink:
    """Holds the open source of one connector, if it is open. ``safe_line`` brings the device into its safe state."""

    def __init__(self, safe_line: bytes | None = None) -> None:
        self._safe_line = safe_line
        self._lock = threading.Lock()
        self._source: ByteSource | None = None
        self.failure: OSError | None = None
        """Why a command could not be written: the body shall open the line again."""

    @contextmanager
    def carried_by(self, source: ByteSource) -> Iterator[None]:
        """Let commands through to ``source`` in this block. Body's thread. Raises :class:`OSError`."""
        with self._lock:
            self.failure = None
            if self._safe_line is not None:
                source.write(b"\n" + self._safe_line + b"\n")  # the first end: half a line may have been said before
            self._source = source
        try:
            yield
        finally:
            with self._lock:
                self._source = None  # first: no command comes after the last line
                if self._safe_line is not None:
                    with suppress(OSError):  # a line that is lost takes none; opening it again repeats it
                        source.write(b"\n" + self._safe_line + b"\n")

    def write(self, data: bytes) -> None:
        """Say ``data``. Receiver's thread. Raises :class:`Refused` (``plugin.no_device``) while the line is away."""
        with self._lock:
            if self._source is None:
                raise Refused("plugin.no_device", "the line isn't open; trying again")
            try:
                self._source.write(data)
            except OSError as error:
                self._source, self.failure = None, error
                raise Refused("plugin.no_device", "the line took nothing; opening it again") from error

    def make_safe(self) -> None:
        """Say the safe line, if there is one. Safety thread; waits at most for one write that hangs."""
        if self._safe_line is not None:
            with suppress(Refused):  # away: whatever is opened again begins with it
                self.write(self._safe_line + b"\n")
