"""Turns in the hashing line for requests: whose client hangs up while it waits leaves the line, and costs nothing."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Coroutine
from contextlib import AsyncExitStack, asynccontextmanager
from functools import partial
from typing import Any, TypeVar

from fastapi import Request

from mosaic_server.security.hashing_line import Hashing
from mosaic_server.security.passwords import HashedPassword, hashed
from mosaic_server.services import Services

T = TypeVar("T")


class ClientGone(Exception):
    """The client hung up before its turn: no answer is needed any more."""


@asynccontextmanager
async def hashing_turn(request: Request, services: Services, who: str) -> AsyncIterator[Hashing]:
    """A turn of :meth:`HashingLine.turn`; raises :class:`ClientGone` if nobody waits for it. Hashing that has begun is
    finished, and a wrong guess counts also where nobody stayed to hear of it."""
    async with AsyncExitStack() as stack:
        turn = stack.enter_async_context(services.hashing.turn(who))
        yield await _while_somebody_waits(request, turn)


async def hashed_for(request: Request, services: Services, who: str, password: str) -> HashedPassword:
    async with hashing_turn(request, services, who) as hashing:
        return await hashing(partial(hashed, password))


async def _while_somebody_waits(request: Request, work: Coroutine[Any, Any, T]) -> T:
    """``work`` is cancelled as soon as the client hangs up. The body of the request has been read."""
    working, leaving = asyncio.ensure_future(work), asyncio.ensure_future(_hung_up(request))
    try:
        await asyncio.wait({working, leaving}, return_when=asyncio.FIRST_COMPLETED)
        if not working.done():
            raise ClientGone
        return working.result()
    finally:
        working.cancel()
        leaving.cancel()
        await asyncio.gather(working, leaving, return_exceptions=True)


async def _hung_up(request: Request) -> None:
    while (await request.receive())["type"] != "http.disconnect":
        pass
