"""The line before the hashing of passwords, which costs a core and 64 MiB each, and the threads that do it."""

from __future__ import annotations

import asyncio
import math
import os
import sys
import threading
from collections import deque
from collections.abc import AsyncIterator, Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import asynccontextmanager
from typing import Protocol, TypeVar

T = TypeVar("T")

HASHING_AT_ONCE = 2
MOST_WAITING = 100
"""Of one address; a whole class that logs in at nine o'clock waits less than ten seconds."""
MOST_IN_LINE = 400
"""Of all addresses together: a minute, where nobody waits twice."""
NICENESS = 10
"""Of the threads, on Linux: the event loop goes first, which serves everybody else."""
_FIRST_GUESS_S = 0.1


class LineTooLong(Exception):
    """So many wait that another would wait in vain."""

    def __init__(self, wait_s: float, *, is_of_address: bool) -> None:
        super().__init__(f"the line is {wait_s:.1f} s long")
        self.retry_after_s = max(1, math.ceil(wait_s))
        self.is_of_address = is_of_address
        """Those who wait came from this one address, not from everywhere."""


class Hashing(Protocol):
    """Runs work on a thread of the line."""

    async def __call__(self, work: Callable[[], T]) -> T: ...


class HashingLine:
    """Lets in two at a time, and of one address one: thirty log-ins from there are one ahead of everybody else's.

    In a full line the newest of the address that has most there makes room. Event-loop thread only.
    """

    def __init__(self) -> None:
        self._threads = ThreadPoolExecutor(HASHING_AT_ONCE, "mosaic-hashing", initializer=_step_back)
        self._waiting: dict[str, deque[asyncio.Future[None]]] = {}
        """By address, in the order in which addresses are let in next."""
        self._served: set[str] = set()
        self._takes_s = _FIRST_GUESS_S

    @asynccontextmanager
    async def turn(self, who: str) -> AsyncIterator[Hashing]:
        """Hash within the block. ``who`` is the address, or the account of somebody who is signed in. Raises
        :class:`LineTooLong`. Whoever is cancelled leaves the line."""
        await self._let_in(who)
        try:
            yield self._run
        finally:
            self._over(who)

    def close(self) -> None:
        """Waits for what is being hashed."""
        self._threads.shutdown(cancel_futures=True)

    async def _run(self, work: Callable[[], T]) -> T:
        loop = asyncio.get_running_loop()
        began_s = loop.time()
        job = loop.run_in_executor(self._threads, work)
        try:
            result = await asyncio.shield(job)
        except asyncio.CancelledError:
            await asyncio.wait([job])  # no thread can be stopped: until this one is free, the turn isn't over
            raise
        self._takes_s += 0.1 * (loop.time() - began_s - self._takes_s)
        return result

    async def _let_in(self, who: str) -> None:
        mine = self._waiting.get(who, ())
        if len(mine) >= MOST_WAITING:
            raise LineTooLong(len(mine) * self._takes_s, is_of_address=True)
        in_line = sum(map(len, self._waiting.values()))
        if in_line >= MOST_IN_LINE:
            self._make_room(len(mine), self._too_long(in_line))
        place: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._waiting.setdefault(who, deque()).append(place)
        self._let_in_next()
        try:
            await asyncio.shield(place)  # or a cancelled place would stand in the line until its task has heard of it
        except asyncio.CancelledError:
            self._leave(who, place)
            raise

    def _too_long(self, in_line: int) -> LineTooLong:
        return LineTooLong(in_line * self._takes_s / HASHING_AT_ONCE, is_of_address=False)

    def _make_room(self, of_newcomer: int, refusal: LineTooLong) -> None:
        longest = max(self._waiting.values(), key=len)
        if len(longest) <= of_newcomer + 1:
            raise refusal
        longest.pop().set_exception(refusal)

    def _let_in_next(self) -> None:
        for who in [one for one in self._waiting if one not in self._served]:
            if len(self._served) >= HASHING_AT_ONCE:
                return
            place = self._waiting[who].popleft()
            self._forget_if_empty(who)
            self._served.add(who)
            place.set_result(None)

    def _leave(self, who: str, place: asyncio.Future[None]) -> None:
        """Cancelled while waiting, or in the moment in which the turn came or the place was lost."""
        if not place.done():
            self._waiting[who].remove(place)
            self._forget_if_empty(who)
        elif place.exception() is None:
            self._over(who)

    def _over(self, who: str) -> None:
        self._served.discard(who)
        if behind := self._waiting.pop(who, None):  # all other addresses come before its next
            self._waiting[who] = behind
        self._let_in_next()

    def _forget_if_empty(self, who: str) -> None:
        if not self._waiting[who]:
            del self._waiting[who]


def _step_back() -> None:
    if sys.platform == "linux":  # elsewhere a priority belongs to the whole process
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), NICENESS)
