"""The base of the taps of a running robot: a thread of a plugin's reads what comes by on the event loop."""

from __future__ import annotations

import asyncio
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Self

from mosaic_core.runtime.threads.handover import on_loop


class Tap(ABC):
    """Opens and closes on the event loop, whatever thread enters and leaves it."""

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._came = threading.Condition()
        """Around what the reader waits for."""
        self.failure = ""

    def __enter__(self) -> Self:
        self._on_loop(self._open)
        return self

    def __exit__(self, *_: object) -> None:
        self._on_loop(self._close)

    @abstractmethod
    def _open(self) -> None:
        """Begin to look; event loop."""

    @abstractmethod
    def _close(self) -> None:
        """Look no more; event loop."""

    def _on_loop(self, act: Callable[[], None]) -> None:
        if not on_loop(self._loop, act):
            self._failed("peer.shutdown")

    def _failed(self, code: str) -> None:
        with self._came:
            self.failure = code
            self._came.notify_all()
