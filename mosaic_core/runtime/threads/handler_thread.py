"""A thread that runs code of a plugin: the event loop can wait for its end, and does not wait for ever."""

from __future__ import annotations

import asyncio
import logging
import threading
from collections.abc import Callable

from mosaic_core.runtime.threads.handover import on_loop
from mosaic_core.runtime.threads.stacks import place_of_thread

logger = logging.getLogger(__name__)

STOP_PATIENCE_S = 1.5
"""How long a body may take to stop; the whole robot has two seconds."""


class HandlerThread:
    """The thread of the connector ``label``; ``live()`` is its whole life. Methods on the event loop."""

    def __init__(self, label: str, live: Callable[[], None]) -> None:
        self._label = label
        self._live = live
        self._loop = asyncio.get_running_loop()
        self._done = asyncio.Event()
        self._thread = threading.Thread(target=self._run, name=f"mosaic-{label}", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def place(self) -> str:
        """The line of its author where it is now."""
        return place_of_thread(self._thread.ident)

    async def ended(self) -> None:
        """Wait until it has ended, or has been abandoned."""
        if not self._thread.is_alive():
            return
        try:
            await asyncio.wait_for(self._done.wait(), STOP_PATIENCE_S)
        except TimeoutError:
            tell_abandoned(self._label, self.place())

    def _run(self) -> None:
        try:
            self._live()
        finally:
            if not on_loop(self._loop, self._done.set):
                logger.debug("connector %r stopped after its robot was gone", self._label)


def tell_abandoned(label: str, place: str = "") -> None:
    """Log that the body of the connector ``label`` did not stop in time and is waited for no longer. ``place``: the
    line where it is."""
    where, fields = f"; it is at {place}" if place else "", {"label": label, "code": "plugin.ignored_stop"}
    text = "connector %r did not stop within %.1f s and was abandoned (plugin.ignored_stop)%s"
    logger.warning(text, label, STOP_PATIENCE_S, where, extra=fields)
