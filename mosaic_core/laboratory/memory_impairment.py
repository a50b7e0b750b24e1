"""Impairs messages and pictures that travel in memory: whole ones are late or lost, where a real one does that to
packets. On a reliable channel a lost message comes a round trip later, and those after it wait for it.
"""

from __future__ import annotations

import asyncio
import itertools
from bisect import insort
from collections.abc import Awaitable, Callable
from typing import Any

from mosaic_core.laboratory.impairment import Impairment
from mosaic_core.machines.laboratory.impaired_link import ImpairedLink

RESEND_S = 0.02
"""Beside the round trip, until what was lost is sent once more."""


class MessageFlow:
    """Delays and loses the messages of one direction of one channel. ``is_cut`` says whether anything passes now."""

    def __init__(
        self,
        impairment: Impairment,
        link: ImpairedLink,
        is_cut: Callable[[], bool],
        deliver: Callable[[bytes | str], None],
        *,
        is_reliable: bool,
    ) -> None:
        self._impairment = impairment
        self._link = link
        self._is_cut = is_cut
        self._deliver = deliver
        self._is_reliable = is_reliable
        self._waiting: list[tuple[int, bytes | str]] = []
        self._numbers = itertools.count()
        self._retry: asyncio.TimerHandle | None = None
        self._is_closed = False

    def take(self, data: bytes | str) -> None:
        """Send one message."""
        self._add(next(self._numbers), data)

    def _add(self, number: int, data: bytes | str) -> None:
        if self._is_reliable:
            insort(self._waiting, (number, data))
            if self._retry is None:
                self._go_on()
        elif not self._is_cut():
            self._try(number, data)

    def close(self) -> None:
        self._is_closed = True
        self._waiting.clear()
        if self._retry is not None:
            self._retry.cancel()

    def _go_on(self) -> None:
        self._retry = None
        while self._waiting and not self._is_cut() and self._try(*self._waiting[0]):
            del self._waiting[0]
        if self._waiting and not self._is_closed:
            profile = self._link.profile
            again_s = RESEND_S + (2 * profile.delay_ms + profile.jitter_ms) / 1e3
            self._retry = asyncio.get_running_loop().call_later(again_s, self._go_on)

    def _try(self, number: int, data: bytes | str) -> bool:
        loop = asyncio.get_running_loop()
        now_s = loop.time()
        arrival_s = self._impairment.arrival_s(self._link, len(data), now_s)
        if arrival_s is None:
            return False
        if arrival_s <= now_s:
            loop.call_soon(self._arrived, number, data)
        else:
            loop.call_at(arrival_s, self._arrived, number, data)
        return True

    def _arrived(self, number: int, data: bytes | str) -> None:
        if not self._is_cut():
            self._deliver(data)
        elif self._is_reliable and not self._is_closed:  # it was on its way when the cable was pulled
            self._add(number, data)


class LatePictures:
    """Pictures that arrive late or never; which of them are sent does not depend on that."""

    def __init__(
        self, impairment: Impairment, is_cut: Callable[[], bool], following: Callable[[], Awaitable[Any]]
    ) -> None:
        self._impairment = impairment
        self._is_cut = is_cut
        self._following = following
        self._arrived: asyncio.Queue[Any] = asyncio.Queue()
        self._sending: asyncio.Task[None] | None = None

    async def next(self) -> Any:
        if self._sending is None:
            self._sending = asyncio.create_task(self._send())
        return await self._arrived.get()

    def stop(self) -> None:
        if self._sending is not None:
            self._sending.cancel()

    async def _send(self) -> None:
        loop = asyncio.get_running_loop()
        while (frame := await self._following()) is not None:
            # How long a picture is once encoded, nobody knows here: it takes none of the link's rate.
            arrival_s = self._impairment.arrival_s(self._impairment.down, 0, loop.time())
            if arrival_s is not None and not self._is_cut():
                loop.call_at(arrival_s, self._arrived.put_nowait, frame)
        self._arrived.put_nowait(None)
