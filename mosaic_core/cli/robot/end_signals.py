"""Ctrl-C and SIGTERM while a robot runs: the first ends it in order, a second one at once, safe actions first.

The handlers are those of Python, not of the event loop: they also run while something blocks the loop.
"""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import sys
import threading
from collections.abc import Callable
from types import FrameType
from typing import Any

from mosaic_core.cli.terminal.error_report import FAILED

logger = logging.getLogger(__name__)

SAFE_WITHIN_S = 0.5
"""For the safe actions, when nothing else is waited for any more."""
OVERDUE_S = 4.0
"""A loop that is blocked hears of no signal: so long after the first one, the end comes without it."""


class EndSignals:
    """Turns signals into the end of a robot. ``make_safe`` runs its safe actions, on a thread of its own; with
    ``safe_first`` already at the first signal, whatever the loop does."""

    def __init__(self, wanted: asyncio.Event, make_safe: Callable[[], object], *, safe_first: bool = False) -> None:
        self._wanted = wanted
        self._make_safe = make_safe
        self._safe_first = safe_first
        self._loop = asyncio.get_running_loop()
        self._count = 0
        self.code = 0
        """With which the program ends after a signal, as a shell has it."""
        self._before: dict[int, Any] = {}
        self._ended = threading.Event()

    def install(self) -> None:
        """On the main thread, which alone may."""
        for number in (signal.SIGINT, signal.SIGTERM):
            self._before[number] = signal.signal(number, self._came)

    def done(self) -> None:
        """The robot has ended in order."""
        self._ended.set()

    def uninstall(self) -> None:
        """The same, and signals mean again what they meant before."""
        self.done()
        for number, before in self._before.items():
            signal.signal(number, before)

    def _came(self, number: int, frame: FrameType | None) -> None:
        self._count += 1
        self.code = 128 + number
        if self._count > 1:
            self._end_at_once(self.code)
        threading.Thread(target=self._watch, name="mosaic-end", daemon=True).start()
        self._loop.call_soon_threadsafe(self._wanted.set)

    def _watch(self) -> None:
        logger.info("the robot ends; a second Ctrl-C ends it at once")
        if self._safe_first:
            self._make_safe()
        if not self._ended.wait(OVERDUE_S):
            logger.error("the robot did not end within %.0f s: something blocks its event loop", OVERDUE_S)
            self._end_at_once(FAILED)

    def _end_at_once(self, code: int) -> None:
        # On another thread: this one may hold the very lock that a safe action needs.
        safe = threading.Thread(target=self._make_safe, name="mosaic-safe", daemon=True)
        safe.start()
        safe.join(SAFE_WITHIN_S)
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
