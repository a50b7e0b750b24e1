"""Holds the frames that came for one connector until it takes them."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable

import can

MAX_WAITING = 4096
"""Frames: half a second of a full bus at 1 Mbit/s."""
Wanted = Callable[[can.Message], bool]


class CanListener:
    """The bus's thread offers, the connector's takes. When it is full, the oldest frames go, and are counted."""

    def __init__(self, wants: Wanted, size: int = MAX_WAITING) -> None:
        self._wants = wants
        self._waiting: deque[can.Message] = deque(maxlen=size)
        self._dropped = 0
        self._news = threading.Condition()

    def offer(self, frame: can.Message) -> None:
        """A frame has come. Bus's thread."""
        if not self._wants(frame):
            return
        with self._news:
            self._dropped += len(self._waiting) == self._waiting.maxlen
            self._waiting.append(frame)
            self._news.notify()

    def forget(self) -> None:
        """The bus is away: when it is back, what came before is old. Wakes whoever waits."""
        with self._news:
            self._waiting.clear()
            self._news.notify()

    def take(self, timeout_s: float = 0.0) -> tuple[list[can.Message], int]:
        """All that waits, and how many were dropped before them. Waits for the first at most ``timeout_s``."""
        with self._news:
            if not self._waiting and timeout_s > 0:
                self._news.wait(timeout_s)
            found, dropped = list(self._waiting), self._dropped
            self._waiting.clear()
            self._dropped = 0
        return found, dropped
