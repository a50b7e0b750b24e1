"""What all taps of a running robot have in common: a viewer on this robot that a plugin's own thread reads."""

from __future__ import annotations

import asyncio
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from types import TracebackType
from typing import Self
from uuid import uuid4

from mosaic_core.runtime.media.media_hub import MediaHub


class Tap(ABC):
    """Opens and closes on the event loop, whatever thread enters and leaves it."""

    def __init__(self, loop: asyncio.AbstractEventLoop, media: MediaHub, label: str) -> None:
        self._loop = loop
        self._media = media
        self._label = label
        self._viewer_id = f"tap-{uuid4().hex}"
        self._came = threading.Condition()
        """Around what the reader waits for."""
        self.failure = ""

    def __enter__(self) -> Self:
        self._on_loop(self._open)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._on_loop(self._close)

    @abstractmethod
    def _start(self) -> None:
        """Watch the camera; event loop."""

    def _close(self) -> None:
        self._media.leave(self._viewer_id)

    def _open(self) -> None:
        if self._label in self._media.cameras():
            self._start()
        else:
            self._failed("channel.unknown_label")

    def _on_loop(self, act: Callable[[], None]) -> None:
        try:
            self._loop.call_soon_threadsafe(act)
        except RuntimeError:
            self._failed("peer.shutdown")  # the loop is closed: the robot has stopped

    def _failed(self, code: str) -> None:
        with self._came:
            self.failure = code
            self._came.notify_all()
