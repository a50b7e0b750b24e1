"""The base of what runs a handler's body: its parts, how it goes, and what it is told.

A handler never has two bodies at once. Stop wakes a waiting body; its generator is closed where it ran, so that its
``with`` blocks exit there. One that ignores stop is abandoned by name after ``STOP_PATIENCE_S``.
"""

from __future__ import annotations

import logging
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any

from mosaic_core.contract.declared.code_lines import standing_at
from mosaic_core.runtime.handlers.handler_host import RuntimeHost
from mosaic_core.runtime.threads.failures import Failures

logger = logging.getLogger(__name__)

Body = Callable[[], Any]
Consume = Callable[[Any], object]


class Runner(ABC):
    """Runs one handler: ``body`` makes its items, ``consume`` takes them. All methods are called on the event loop."""

    def __init__(self, label: str, body: Body, consume: Consume, host: RuntimeHost, failures: Failures) -> None:
        self._label = label
        self._body = body
        self._consume = consume
        self._host = host
        self._failures = failures
        self._has_ended = False
        self._is_closed = False
        self._is_running = False
        self._is_end_told = False
        self._moved_at_s = 0.0
        """When the body began, or gave its last item."""

    @property
    def state(self) -> str:
        """``waiting`` (nobody watches), ``running``, ``failed`` (restarts), ``ended`` (its data is over) or
        ``stopped``."""
        if self._is_closed:
            return "stopped"
        if self._failures.is_failing:
            return "failed"
        if self._is_running:
            return "running"
        return "ended" if self._has_ended else "waiting"

    def still_s(self) -> float:
        """For how many seconds its body has been busy with something of its own, and has given nothing; 0 while it
        does not run, or rests."""
        if self.state != "running" or self._host.rests:
            return 0.0
        return time.monotonic() - max(self._moved_at_s, self._host.rested_at_s)

    def _ended(self) -> None:
        """Its data is over, though nobody stopped it: said once."""
        self._has_ended = True
        if not self._is_end_told:
            self._is_end_told = True
            runs = getattr(getattr(self._body, "__self__", None), "runs", "")
            again = "somebody opens it anew" if runs == "watched" else "the robot starts anew"
            body = getattr(self._body, "__qualname__", "its body")
            text = "connector %r: %s%s has ended without an error, and sends nothing more until %s"
            logger.info(text, self._label, body, standing_at(self._body), again, extra={"label": self._label})

    @abstractmethod
    def place(self) -> str:
        """``FILE:LINE in NAME`` where its body is now; empty if nobody knows."""

    @abstractmethod
    def start(self) -> None: ...
    @abstractmethod
    def want(self, on: bool) -> None:
        """Run it, or let it rest."""

    @abstractmethod
    def close(self) -> None:
        """Begin to stop for good."""

    @abstractmethod
    async def closed(self) -> None:
        """Wait until it has stopped, or has been abandoned."""
