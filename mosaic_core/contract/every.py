"""Ticks of a handler's body: ``for`` in a ``def``, ``async for`` in an ``async def``."""

from __future__ import annotations

import inspect
import sys
from collections.abc import AsyncIterator, Callable, Iterator

from mosaic_core.contract.declared.code_lines import line_in
from mosaic_core.contract.host import HandlerHost
from mosaic_core.words.errors import MosaicError


def refuse_in_async(waits: str, instead: str) -> None:
    """Raise :class:`MosaicError` (``plugin.blocks_loop``) if who calls the caller, and so ``waits``, is an ``async
    def``."""
    frame = sys._getframe(2)
    code = frame.f_code
    if code.co_flags & (inspect.CO_COROUTINE | inspect.CO_ASYNC_GENERATOR):
        message = f"{waits} in an `async def` would stop the whole robot: {line_in(frame)}."
        cure = f"Write `{instead}` in line {frame.f_lineno}, or make {code.co_name} a `def`, which has its own thread."
        raise MosaicError(f"{message} {cure}", code="plugin.blocks_loop", cure=cure)


class Every:
    """The ticks of ``Handler.every``: iterate with ``for`` in a ``def`` body, ``async for`` in an ``async`` one.

    The first tick comes at once; then one per period on a fixed grid. A body that is late skips ticks instead of
    catching up. The iteration ends when the handler shall stop.
    """

    def __init__(self, host: HandlerHost, period_s: float) -> None:
        if not period_s > 0:
            message = f"every({period_s!r}): a period is more than 0 seconds"
            raise ValueError(f"{message}; without any rest write `while not self.is_stopping`")
        self._host = host
        self._period_s = period_s

    def __iter__(self) -> Iterator[int]:
        """Raises :class:`MosaicError` (``plugin.blocks_loop``) in an ``async def``, whose thread is all robot's."""
        refuse_in_async("A `for` over every(…)", "async for")
        return self._ticks()

    def _ticks(self) -> Iterator[int]:
        tick, start_s = 0, self._host.monotonic_s()
        while not self._host.is_stopping:
            yield tick
            tick, wait_s = self.next_tick(tick, start_s)
            if self._host.wait(wait_s):
                return

    def __aiter__(self) -> AsyncIterator[int]:
        return _AsyncTicks(self._host, self.next_tick)

    def next_tick(self, tick: int, start_s: float) -> tuple[int, float]:
        """The tick after ``tick``, and the seconds until then; ``start_s``: when tick 0 was."""
        elapsed_s = self._host.monotonic_s() - start_s
        following = max(tick + 1, int(elapsed_s / self._period_s))
        return following, max(0.0, following * self._period_s - elapsed_s)


class _AsyncTicks:
    """Iterates over the ticks of an ``async`` body. No generator: one that is left early would have to be closed by a
    task of its own, for which a loop that ends has no time."""

    def __init__(self, host: HandlerHost, following: Callable[[int, float], tuple[int, float]]) -> None:
        self._host = host
        self._following = following
        self._start_s = host.monotonic_s()
        self._tick: int | None = None

    def __aiter__(self) -> AsyncIterator[int]:
        return self

    async def __anext__(self) -> int:
        is_over = self._host.is_stopping
        if self._tick is None:
            self._tick = 0
        elif not is_over:
            self._tick, wait_s = self._following(self._tick, self._start_s)
            is_over = await self._host.wait_async(wait_s)
        if is_over:
            raise StopAsyncIteration
        return self._tick
