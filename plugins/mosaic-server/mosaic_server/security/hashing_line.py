"""The line before the hashing of passwords, which costs a core and 64 MiB each."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field

HASHING_AT_ONCE = 2
MOST_WAITING = 100
"""Of one address; a whole class that logs in at nine o'clock waits less than ten seconds."""


class LineTooLong(Exception):
    """So many wait at this address that another would wait in vain."""


@dataclass(slots=True)
class _AddressLine:
    turn: asyncio.Lock = field(default_factory=asyncio.Lock)
    waiting: int = 0


class HashingLine:
    """Lets in two at a time, and of one address one: thirty log-ins from there are one ahead of everybody else's.

    Event-loop thread only.
    """

    def __init__(self) -> None:
        self._slots = asyncio.Semaphore(HASHING_AT_ONCE)
        self._of: dict[str, _AddressLine] = {}

    @asynccontextmanager
    async def turn(self, who: str) -> AsyncIterator[None]:
        """Hash within the block. ``who`` is the address, or the account of somebody who is signed in. Raises
        :class:`LineTooLong`."""
        mine = self._of.setdefault(who, _AddressLine())
        if mine.waiting >= MOST_WAITING:
            raise LineTooLong
        mine.waiting += 1
        try:
            async with mine.turn, self._slots:
                yield
        finally:
            mine.waiting -= 1
            if not mine.waiting:
                del self._of[who]
