"""Keeps the callbacks of who wants to hear of something, until they have heard enough."""

from __future__ import annotations

import asyncio
import inspect
import logging
import time
from collections import deque
from collections.abc import AsyncIterator, Callable
from typing import Generic, ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")

COMPLAINT_S = 5.0
"""Between two logged exceptions of the same callbacks."""
_log = logging.getLogger(__name__)


class Complaints:
    """Logs what a program's callbacks raise, one in :data:`COMPLAINT_S`, and how many there were."""

    def __init__(self) -> None:
        self._logged_at_s = float("-inf")
        self._count = 0

    def log(self, who: str) -> None:
        """Log the exception that is being handled."""
        self._count += 1
        now_s = time.monotonic()
        if now_s - self._logged_at_s >= COMPLAINT_S:
            self._logged_at_s = now_s
            _log.exception("%s failed (%d so far)", who, self._count)


class Listeners(Generic[P]):
    """Lists callbacks in the order in which they were added; one may leave while they are being called."""

    def __init__(self) -> None:
        self._callbacks: list[Callable[P, object]] = []
        self._complaints = Complaints()

    def add(self, callback: Callable[P, object]) -> Callable[[], None]:
        """Returns what ends it; ending it twice does nothing. Raises :class:`TypeError` for an ``async`` one, which
        nobody would await."""
        if inspect.iscoroutinefunction(callback):
            cure = "write `def`, and start a task in it: asyncio.create_task(…)"
            raise TypeError(f"{callback.__qualname__} is called without being awaited: {cure}")
        self._callbacks.append(callback)
        return lambda: self._callbacks.remove(callback) if callback in self._callbacks else None

    def tell(self, *args: P.args, **kwargs: P.kwargs) -> None:
        """Call every callback. What one raises is logged, and takes nothing from the others or from who tells."""
        for callback in tuple(self._callbacks):
            try:
                callback(*args, **kwargs)
            except Exception:  # noqa: BLE001 - a program's own code may fail in any way
                self._complaints.log(f"the callback {getattr(callback, '__qualname__', callback)}")

    def __len__(self) -> int:
        return len(self._callbacks)


async def first_heard(listen: Callable[[Callable[[T], None]], Callable[[], None]]) -> T:
    """The first value that ``listen(callback)`` gives from now on; then what it returned ends it."""
    heard: asyncio.Future[T] = asyncio.get_running_loop().create_future()
    end = listen(lambda value: None if heard.done() else heard.set_result(value))
    try:
        return await heard
    finally:
        end()


async def all_heard(listen: Callable[[Callable[[T], None]], Callable[[], None]], most: int) -> AsyncIterator[T]:
    """Every value that ``listen(callback)`` gives from now on, for ever. Who falls further behind than ``most`` loses
    the oldest: memory stays bounded."""
    queue: deque[T] = deque(maxlen=most)
    arrived = asyncio.Event()

    def take(value: T) -> None:
        queue.append(value)
        arrived.set()

    end = listen(take)
    try:
        while True:
            while queue:
                yield queue.popleft()
            arrived.clear()
            await arrived.wait()
    finally:
        end()
