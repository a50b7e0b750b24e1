"""Runs the bodies of handlers: a ``def`` body on one thread of its own for life, an ``async`` one as a task.

A handler never has two bodies at once. Stop wakes a waiting body; its generator is closed where it ran, so that its
``with`` blocks exit there. One that ignores stop is abandoned by name after :data:`STOP_PATIENCE_S`.
"""

from __future__ import annotations

import asyncio
import inspect
import logging
import threading
import time
from collections.abc import AsyncIterator, Callable, Iterable
from typing import Any, Protocol

from mosaic_core.contract.handler import DataChannelSendable, Handler, MediaTrackHandler
from mosaic_core.runtime.failures import Failures
from mosaic_core.runtime.handler_host import RuntimeHost

logger = logging.getLogger(__name__)

STOP_PATIENCE_S = 1.5
"""How long a body may take to stop; the whole robot has two seconds."""
_ASYNC_PATIENCE_S = 0.3
"""After this an ``async`` body that does not look at the stop is cancelled."""

Body = Callable[[], Any]
Consume = Callable[[Any], object]


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


def body_of(handler: Handler) -> tuple[Body, Consume] | None:
    """The handler's ``messages`` or ``frames`` and what takes its items; ``None`` for one that only pushes."""
    if isinstance(handler, MediaTrackHandler):
        return None if type(handler).frames is MediaTrackHandler.frames else (handler.frames, handler.send_frame)
    if isinstance(handler, DataChannelSendable):
        unwritten = type(handler).messages is DataChannelSendable.messages
        return None if unwritten else (handler.messages, handler.send)
    return None


def runner_of(handler: Handler, host: RuntimeHost, failures: Failures) -> Runner | None:
    """The runner that fits the handler's body, ``def`` or ``async def``."""
    parts = body_of(handler)
    if parts is None:
        return None
    kind = TaskRunner if inspect.isasyncgenfunction(parts[0]) else ThreadRunner
    return kind(handler.label, *parts, host, failures)


class ThreadRunner:
    """A ``def`` body."""

    def __init__(self, label: str, body: Body, consume: Consume, host: RuntimeHost, failures: Failures) -> None:
        self._label = label
        self._body = body
        self._consume = consume
        self._host = host
        self._failures = failures
        self._changed = threading.Condition()
        self._is_wanted = False
        self._has_ended = False
        self._is_closed = False
        self._is_running = False
        self._thread = threading.Thread(target=self._live, name=f"mosaic-{label}", daemon=True)
        self._done = asyncio.Event()
        self._loop = asyncio.get_running_loop()

    @property
    def state(self) -> str:
        if self._is_closed:
            return "stopped"
        if self._failures.is_failing:
            return "failed"
        if self._is_running:
            return "running"
        return "ended" if self._has_ended else "waiting"

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
        if not self._thread.is_alive():
            return
        try:
            await asyncio.wait_for(self._done.wait(), STOP_PATIENCE_S)
        except TimeoutError:
            _abandoned(self._label)

    # -- the handler's own thread --------------------------------------------------------------------------------

    def _live(self) -> None:
        try:
            while self._turn_came():
                self._run_once()
        finally:
            try:
                self._loop.call_soon_threadsafe(self._done.set)
            except RuntimeError:
                logger.debug("connector %r stopped after its robot was gone", self._label)

    def _turn_came(self) -> bool:
        with self._changed:
            self._is_running = False
            self._changed.wait_for(lambda: self._is_closed or (self._is_wanted and not self._has_ended))
            if self._is_closed:
                return False
            self._host.arm()
            self._is_running = True
            return True

    def _run_once(self) -> None:
        started_s = time.monotonic()
        try:
            self._iterate()
        except (Exception, SystemExit) as error:  # noqa: BLE001 (a plugin may raise anything; none stops the robot)
            if self._host.is_stopping:
                logger.debug("connector %r raised while it stopped: %s", self._label, error)
                return
            delay_s = self._failures.failed(error, time.monotonic() - started_s)
            with self._changed:
                self._is_running = False
                self._changed.wait_for(lambda: self._is_closed or not self._is_wanted, delay_s)
        else:
            with self._changed:
                self._has_ended = not self._host.is_stopping

    def _iterate(self) -> None:
        stream: Iterable[Any] = self._body()
        try:
            for item in stream:
                if self._host.is_stopping:
                    return
                self._consume(item)
                self._failures.alive()
        finally:
            close = getattr(stream, "close", None)
            if close is not None:
                close()


class TaskRunner:
    """An ``async def`` body. Everything here runs on the event loop."""

    def __init__(self, label: str, body: Body, consume: Consume, host: RuntimeHost, failures: Failures) -> None:
        self._label = label
        self._body = body
        self._consume = consume
        self._host = host
        self._failures = failures
        self._wish = asyncio.Event()
        self._has_ended = False
        self._is_closed = False
        self._is_running = False
        self._task: asyncio.Task[None] | None = None

    @property
    def state(self) -> str:
        if self._is_closed:
            return "stopped"
        if self._failures.is_failing:
            return "failed"
        if self._is_running:
            return "running"
        return "ended" if self._has_ended else "waiting"

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
            _abandoned(self._label)

    async def _live(self) -> None:
        while True:
            await self._wish.wait()
            if self._is_closed:
                return
            self._host.arm()
            self._is_running = True
            delay_s = await self._run_once()
            self._is_running = False
            if delay_s is None:
                self._has_ended = not self._host.is_stopping
                if self._has_ended:
                    self._wish.clear()
            else:
                await self._host.wait_async(delay_s)

    async def _run_once(self) -> float | None:
        started_s = time.monotonic()
        body = asyncio.ensure_future(self._iterate())
        stop = asyncio.ensure_future(self._host.stopped())
        try:
            await asyncio.wait({body, stop}, return_when=asyncio.FIRST_COMPLETED)
            if not body.done():
                await asyncio.wait({body}, timeout=_ASYNC_PATIENCE_S)
        finally:
            stop.cancel()
            body.cancel()
        await asyncio.wait({body})
        if body.cancelled() or self._host.is_stopping:
            return None
        error = body.exception()
        return self._failures.failed(error, time.monotonic() - started_s) if error is not None else None

    async def _iterate(self) -> None:
        stream: AsyncIterator[Any] = self._body()
        try:
            async for item in stream:
                if self._host.is_stopping:
                    return
                self._consume(item)
                self._failures.alive()
                await asyncio.sleep(0)  # a body that never waits must not stop the others
        finally:
            close = getattr(stream, "aclose", None)
            if close is not None:
                await close()


def _abandoned(label: str) -> None:
    logger.warning(
        "connector %r did not stop within %.1f s and was abandoned (plugin.ignored_stop)",
        label,
        STOP_PATIENCE_S,
        extra={"label": label, "code": "plugin.ignored_stop"},
    )
