"""Runs an ``async def`` body as a task on the event loop."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import AsyncIterator
from typing import Any

from mosaic_core.contract.declared.code_lines import hand_over, line_in
from mosaic_core.runtime.handlers.handler_host import RuntimeHost
from mosaic_core.runtime.handlers.runner import Body, Consume, Runner
from mosaic_core.runtime.threads.error_words import meant_by
from mosaic_core.runtime.threads.failures import Failures
from mosaic_core.runtime.threads.handler_thread import STOP_PATIENCE_S, tell_abandoned

logger = logging.getLogger(__name__)

_PATIENCE_S = 0.3
"""After this a body that does not look at the stop is cancelled."""


def leave_behind(task: asyncio.Task[Any]) -> None:
    """Let nobody wait for ``task`` any more, who swallows what cancels it: ``asyncio.run`` would, for ever."""
    asyncio._unregister_task(task)


class TaskRunner(Runner):
    """Runs an ``async def`` body. Everything here runs on the event loop."""

    def __init__(self, label: str, body: Body, consume: Consume, host: RuntimeHost, failures: Failures) -> None:
        super().__init__(label, body, consume, host, failures)
        self._wish = asyncio.Event()
        self._task: asyncio.Task[None] | None = None
        self._body_task: asyncio.Task[BaseException | None] | None = None
        self._stream: AsyncIterator[Any] | None = None

    def place(self) -> str:
        return line_in(getattr(self._stream, "ag_frame", None))

    def start(self) -> None:
        self._task = asyncio.get_running_loop().create_task(self._live(), name=f"mosaic-{self._label}")

    def want(self, on: bool) -> None:
        if on:
            self._has_ended = False
            self._wish.set()
        else:
            self._wish.clear()
            self._host.stop()

    def close(self) -> None:
        self._is_closed = True
        self._wish.set()
        self._host.stop()

    async def closed(self) -> None:
        if self._task is None:
            return
        _, pending = await asyncio.wait({self._task}, timeout=STOP_PATIENCE_S)
        if pending:
            self._task.cancel()
            tell_abandoned(self._label)
            if self._body_task is not None and not self._body_task.done():
                leave_behind(self._body_task)

    async def _live(self) -> None:
        while True:
            await self._wish.wait()
            if self._is_closed:
                return
            self._host.arm()
            self._moved_at_s = time.monotonic()
            self._is_running = True
            delay_s = await self._run_once()
            self._is_running = False
            if delay_s is None:
                if not self._host.is_stopping:
                    self._ended()
                    self._wish.clear()
            else:
                await self._host.wait_async(delay_s)

    async def _run_once(self) -> float | None:
        started_s = time.monotonic()
        self._body_task = body = asyncio.get_running_loop().create_task(self._outcome())
        stop = asyncio.ensure_future(self._host.stopped())
        try:
            await asyncio.wait({body, stop}, return_when=asyncio.FIRST_COMPLETED)
            if not body.done():
                await asyncio.wait({body}, timeout=_PATIENCE_S)
        finally:
            stop.cancel()
            body.cancel()
        await asyncio.wait({body})
        error = None if body.cancelled() else body.result()
        if error is None:
            return None
        if self._host.is_stopping:
            logger.debug("connector %r raised while it stopped: %s", self._label, error)
            return None
        return self._failures.failed(error, time.monotonic() - started_s)

    async def _outcome(self) -> BaseException | None:
        """The error that ended it. A ``SystemExit`` that left the task would end the event loop and the robot. So would
        a ``KeyboardInterrupt``, which is the user's own when the handler shall stop anyway; and what cancels the body
        is ours only then: else something was cancelled that it waited for."""
        try:
            await self._iterate()
        except (KeyboardInterrupt, asyncio.CancelledError) as error:
            if self._host.is_stopping:
                raise
            return error
        except BaseException as error:  # noqa: BLE001 (a plugin may raise anything; none stops the robot)
            return meant_by(error)
        return None

    async def _iterate(self) -> None:
        self._stream = stream = self._body()
        try:
            async for item in stream:
                if self._host.is_stopping:
                    return
                hand_over(stream, item, self._consume)
                self._moved_at_s = time.monotonic()
                self._failures.alive()
                await asyncio.sleep(0)  # a body that never waits must not stop the others
        finally:
            close = getattr(stream, "aclose", None)
            if close is not None:
                await close()
