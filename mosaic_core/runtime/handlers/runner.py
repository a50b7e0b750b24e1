"""Runs the bodies of handlers: a ``def`` body on one thread of its own for life, an ``async`` one as a task.

A handler never has two bodies at once. Stop wakes a waiting body; its generator is closed where it ran, so that its
``with`` blocks exit there. One that ignores stop is abandoned by name after ``STOP_PATIENCE_S``.
"""

from __future__ import annotations

import inspect
from typing import Protocol

from mosaic_core.contract.handler import Handler
from mosaic_core.runtime.handlers.body import body_of
from mosaic_core.runtime.handlers.handler_host import RuntimeHost
from mosaic_core.runtime.handlers.task_runner import TaskRunner
from mosaic_core.runtime.handlers.thread_runner import ThreadRunner
from mosaic_core.runtime.threads.failures import Failures


class Runner(Protocol):
    """Runs one handler. All methods are called on the event loop."""

    @property
    def state(self) -> str:
        """``waiting`` (nobody watches), ``running``, ``failed`` (restarts), ``ended`` (its data is over) or
        ``stopped``."""
        ...

    def start(self) -> None: ...
    def want(self, on: bool) -> None:
        """Run it, or let it rest."""
        ...

    def close(self) -> None:
        """Begin to stop for good."""
        ...

    async def closed(self) -> None:
        """Wait until it has stopped, or has been abandoned."""
        ...


def runner_of(handler: Handler, host: RuntimeHost, failures: Failures) -> Runner | None:
    """The runner that fits the handler's body, ``def`` or ``async def``."""
    parts = body_of(handler)
    if parts is None:
        return None
    kind = TaskRunner if inspect.isasyncgenfunction(parts[0]) else ThreadRunner
    return kind(handler.label, *parts, host, failures)
