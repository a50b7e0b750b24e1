"""Runs a ``def`` body on one thread of its own for life; its generator is closed there too."""

from __future__ import annotations

import logging
import threading
import time

from mosaic_core.contract.declared.code_lines import hand_over
from mosaic_core.contract.declared.yielded import items_of
from mosaic_core.runtime.handlers.handler_host import RuntimeHost
from mosaic_core.runtime.handlers.runner import Body, Consume, Runner
from mosaic_core.runtime.threads.failures import Failures
from mosaic_core.runtime.threads.handler_thread import HandlerThread

logger = logging.getLogger(__name__)


class ThreadRunner(Runner):
    """Runs a ``def`` body."""

    def __init__(self, label: str, body: Body, consume: Consume, host: RuntimeHost, failures: Failures) -> None:
        super().__init__(label, body, consume, host, failures)
        self._changed = threading.Condition()
        self._is_wanted = False
        self._thread = HandlerThread(label, self._live)

    def place(self) -> str:
        return self._thread.place()

    def start(self) -> None:
        self._thread.start()

    def want(self, on: bool) -> None:
        with self._changed:
            if on == self._is_wanted:
                return
            self._is_wanted = on
            if on:
                self._has_ended = False
            else:
                self._host.stop()
            self._changed.notify_all()

    def close(self) -> None:
        with self._changed:
            self._is_closed = True
            self._host.stop()
            self._changed.notify_all()

    async def closed(self) -> None:
        await self._thread.ended()

    # -- the handler's own thread --------------------------------------------------------------------------------

    def _live(self) -> None:
        while self._turn_came():
            self._run_once()

    def _turn_came(self) -> bool:
        with self._changed:
            self._is_running = False
            self._changed.wait_for(lambda: self._is_closed or (self._is_wanted and not self._has_ended))
            if self._is_closed:
                return False
            self._host.arm()
            self._moved_at_s = time.monotonic()
            self._is_running = True
            return True

    def _run_once(self) -> None:
        started_s = time.monotonic()
        try:
            self._iterate()
        except BaseException as error:  # noqa: BLE001 (a plugin may raise anything; none ends its thread unnoticed)
            if self._host.is_stopping:
                logger.debug("connector %r raised while it stopped: %s", self._label, error)
                return
            delay_s = self._failures.failed(error, time.monotonic() - started_s)
            with self._changed:
                self._is_running = False
                self._changed.wait_for(lambda: self._is_closed or not self._is_wanted, delay_s)
        else:
            with self._changed:
                if not self._host.is_stopping:
                    self._ended()

    def _iterate(self) -> None:
        stream = items_of(self._body)
        try:
            for item in stream:
                if self._host.is_stopping:
                    return
                hand_over(stream, item, self._consume)
                self._moved_at_s = time.monotonic()
                self._failures.alive()
        finally:
            close = getattr(stream, "close", None)
            if close is not None:
                close()
