"""Hands calls from any thread to the event loop: never blocks, keeps the order, wakes the loop once per burst."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")
_AT_ONCE = 256
"""Items delivered before others on the loop get their turn."""


def on_loop(loop: asyncio.AbstractEventLoop, action: Callable[[], object]) -> bool:
    """Call ``action`` on the event loop soon; ``False``: the loop is closed, as the robot has stopped. Any thread."""
    try:
        loop.call_soon_threadsafe(action)
    except RuntimeError:
        return False
    return True


class Handover(Generic[T]):
    """Hands items over from any thread to the event loop. ``put`` on any thread; ``deliver`` is called on the loop."""

    def __init__(self, loop: asyncio.AbstractEventLoop, deliver: Callable[[T], None], max_items: int = 10_000) -> None:
        self._loop = loop
        self._deliver = deliver
        self._max_items = max_items
        self._items: deque[T] = deque()
        self._is_scheduled = False

    def put(self, item: T) -> bool:
        """``False`` if the loop doesn't keep up, or is gone."""
        if len(self._items) >= self._max_items:
            return False
        self._items.append(item)  # before the flag is read: _drain clears it before it empties the queue
        if not self._is_scheduled:
            self._is_scheduled = True
            return on_loop(self._loop, self._drain)
        return True

    def __len__(self) -> int:
        return len(self._items)

    def _drain(self) -> None:
        self._is_scheduled = False
        for _ in range(_AT_ONCE):
            try:
                item = self._items.popleft()
            except IndexError:
                return
            self._deliver(item)
        if self._items and not self._is_scheduled:
            self._is_scheduled = True
            self._loop.call_soon(self._drain)
