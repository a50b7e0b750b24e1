"""Keeps the callbacks of who wants to hear of something, until they have heard enough."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncIterator, Callable, Iterator
from typing import Generic, ParamSpec, TypeVar

P = ParamSpec("P")
T = TypeVar("T")


class Listeners(Generic[P]):
    """Lists callbacks in the order in which they were added; one may leave while they are being called."""

    def __init__(self) -> None:
        self._callbacks: list[Callable[P, object]] = []

    def add(self, callback: Callable[P, object]) -> Callable[[], None]:
        """Returns what ends it; ending it twice does nothing."""
        self._callbacks.append(callback)
        return lambda: self._callbacks.remove(callback) if callback in self._callbacks else None

    def __iter__(self) -> Iterator[Callable[P, object]]:
        return iter(tuple(self._callbacks))

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
