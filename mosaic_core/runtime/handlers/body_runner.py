"""What the two runners of a body have in common: its parts, and the words for how it goes."""

from __future__ import annotations

from mosaic_core.runtime.handlers.body import Body, Consume
from mosaic_core.runtime.handlers.handler_host import RuntimeHost
from mosaic_core.runtime.threads.failures import Failures


class BodyRunner:
    """The base of both; they differ in where the body runs, and so in how they wait."""

    def __init__(self, label: str, body: Body, consume: Consume, host: RuntimeHost, failures: Failures) -> None:
        self._label = label
        self._body = body
        self._consume = consume
        self._host = host
        self._failures = failures
        self._has_ended = False
        self._is_closed = False
        self._is_running = False

    @property
    def state(self) -> str:
        """See :class:`~mosaic_core.runtime.handlers.runner.Runner`."""
        if self._is_closed:
            return "stopped"
        if self._failures.is_failing:
            return "failed"
        if self._is_running:
            return "running"
        return "ended" if self._has_ended else "waiting"
