"""An event loop on the fake clock: what sleeps in it lets the clock advance, and nobody waits."""

from __future__ import annotations

import asyncio
import selectors
import time
from collections.abc import Callable, Coroutine
from concurrent.futures import Executor
from typing import Any, TypeVar

from mosaic_core.harness.fake_hosts import FakeClock

T = TypeVar("T")


def run_on(clock: FakeClock, body: Callable[[], Coroutine[Any, Any, T]]) -> T:
    """Run ``body()`` in a loop of its own, whose ``asyncio.sleep`` and ``asyncio.timeout`` advance ``clock``."""
    with asyncio.Runner(loop_factory=lambda: FakeTimeLoop(clock)) as runner:
        return runner.run(body())


class FakeTimeLoop(asyncio.SelectorEventLoop):
    """Time passes when there is nothing else to do. While a thread works for it (``asyncio.to_thread``) or a socket is
    open, the loop really waits for them."""

    def __init__(self, clock: FakeClock) -> None:
        self._clock = clock
        self._working = 0
        super().__init__(_Selector(clock, lambda: self._working > 0))

    def time(self) -> float:
        """The clock's."""
        return self._clock.now_s

    def run_in_executor(  # type: ignore[override]  # of the base it is a future that only a running loop may await
        self, executor: Executor | None, func: Callable[..., T], *args: Any
    ) -> asyncio.Future[T]:
        """As any loop, and time stands still until ``func`` has returned."""
        future: asyncio.Future[T] = super().run_in_executor(executor, func, *args)
        self._working += 1
        future.add_done_callback(self._returned)
        return future

    async def shutdown_default_executor(self, *arguments: Any, **named: Any) -> None:
        """As any loop; no time passes any more."""
        self._working += 1
        await super().shutdown_default_executor(*arguments, **named)

    def _returned(self, future: asyncio.Future[Any]) -> None:
        self._working -= 1


_OWN_SOCKETS = 1
"""A loop has one itself, by which threads wake it."""


class _Selector(selectors.DefaultSelector):
    """Looks whether something has arrived; if nothing can, the time until the next timer passes at once."""

    def __init__(self, clock: FakeClock, is_working: Callable[[], bool]) -> None:
        super().__init__()
        self._clock = clock
        self._is_working = is_working

    def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
        if timeout is not None and timeout <= 0:  # the loop has work to do
            return super().select(0)
        if timeout is None or self._is_working():
            return super().select(None)
        is_listening = len(self.get_map()) > _OWN_SOCKETS
        began_s = time.monotonic()
        ready = super().select(timeout if is_listening else 0)
        self._clock.advance(min(timeout, time.monotonic() - began_s) if ready else timeout)
        return ready
