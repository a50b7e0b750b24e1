"""What waits for a reader who may be slow: bounded by its size, and the oldest goes first."""

from __future__ import annotations

from collections import deque
from typing import Generic, TypeVar

T = TypeVar("T")


class Backlog(Generic[T]):
    """A queue of at most ``max_bytes`` that loses its oldest items, and counts them."""

    def __init__(self, max_bytes: int) -> None:
        self._max_bytes = max_bytes
        self._items: deque[tuple[T, int]] = deque()
        self.size_bytes = 0
        self.dropped = 0

    def put(self, item: T, size_bytes: int) -> None:
        """The newest. One that is larger than everything may be is lost itself, and the others stay."""
        if size_bytes > self._max_bytes:
            self.dropped += 1
            return
        while self.size_bytes + size_bytes > self._max_bytes:
            self.size_bytes -= self._items.popleft()[1]
            self.dropped += 1
        self._items.append((item, size_bytes))
        self.size_bytes += size_bytes

    def take(self) -> T | None:
        """The oldest; ``None``: there is none."""
        if not self._items:
            return None
        item, size_bytes = self._items.popleft()
        self.size_bytes -= size_bytes
        return item

    def __len__(self) -> int:
        return len(self._items)
