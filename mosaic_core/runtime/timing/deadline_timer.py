"""Calls back once at a deadline that can be moved as often as wanted."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable


class DeadlineTimer:
    """Sets one timer of the event loop anew whenever its deadline moves. Event loop only."""

    def __init__(self, passed: Callable[[], None]) -> None:
        self._passed = passed
        self._deadline_s = 0.0
        self._handle: asyncio.TimerHandle | None = None

    def set(self, deadline_s: float | None) -> None:
        """Call back when the monotonic clock shows ``deadline_s``, at once if it already does; ``None``: never."""
        if self._handle is not None:
            self._handle.cancel()
            self._handle = None
        if deadline_s is not None:
            self._deadline_s = deadline_s
            delay_s = max(0.0, deadline_s - time.monotonic())
            self._handle = asyncio.get_running_loop().call_later(delay_s, self._fire)

    @property
    def is_set(self) -> bool:
        """It will call back."""
        return self._handle is not None

    def cancel(self) -> None:
        """Never call back, unless it is set again. Needs no running event loop."""
        if self._handle is not None:
            self._handle.cancel()
            self._handle = None

    def _fire(self) -> None:
        """uvloop counts in whole milliseconds, so that it may come a little early: who then asks the clock whether the
        deadline has passed would hear no, and never be called again."""
        self._handle = None
        if time.monotonic() < self._deadline_s:
            self.set(self._deadline_s)
        else:
            self._passed()
