"""A server is tried at all addresses of its name at the same time: the first that works wins, for any of them may lead
nowhere. What the others got is given back.
"""

from __future__ import annotations

import asyncio
import ssl
from collections.abc import Awaitable, Callable, Coroutine, Sequence
from typing import Any, TypeAlias, TypeVar

from aioice import stun

from mosaic_core.runtime.timing.background_tasks import BackgroundTasks

T = TypeVar("T")
GiveBack: TypeAlias = Callable[[T], Awaitable[None]]
GRACE_S = 1.0
"""An address as good as the winner answers within this, and then says a proper good-bye: a TURN server would hold an
allocation of which it heard nothing more for ten minutes, and count it against the account's quota."""
_ANSWERS = (stun.TransactionFailed, ssl.SSLError)
"""Errors that the server itself caused: they tell more than an address that leads nowhere."""

_leaving = BackgroundTasks()


async def first_address(
    look_up: Awaitable[Sequence[str]],
    attempt: Callable[[str], Coroutine[Any, Any, T]],
    timeout_s: float,
    give_back: GiveBack[T] | None = None,
) -> T:
    """The first result of ``attempt(address)``; ``give_back`` gets later ones.

    Raises the error that tells most: what the server itself said, else :class:`TimeoutError` if an address was still
    silent, else what came last. ``look_up`` counts as well, and may raise :class:`OSError`.
    """
    loop = asyncio.get_running_loop()
    deadline_s = loop.time() + timeout_s
    async with asyncio.timeout_at(deadline_s):
        addresses = await look_up
    tasks = [asyncio.create_task(attempt(address)) for address in addresses]
    winner: asyncio.Task[T] | None = None
    try:
        winner, errors = await _settled(tasks, deadline_s)
        if winner is None:
            raise next((one for one in errors if isinstance(one, _ANSWERS)), errors[-1])
        return winner.result()
    finally:
        _leave([task for task in tasks if task is not winner], give_back, 0.0 if winner is None else GRACE_S)


async def _settled(
    tasks: Sequence[asyncio.Task[T]], deadline_s: float
) -> tuple[asyncio.Task[T] | None, list[BaseException]]:
    """The first that worked, or all errors in the order in which they came."""
    loop, errors, waiting = asyncio.get_running_loop(), list[BaseException](), set(tasks)
    while waiting:
        left_s = max(0.0, deadline_s - loop.time())
        done, waiting = await asyncio.wait(waiting, timeout=left_s, return_when=asyncio.FIRST_COMPLETED)
        if not done:
            return None, [*errors, TimeoutError()]
        for task in sorted(done, key=tasks.index):
            error = task.exception()
            if error is None:
                return task, errors
            errors.append(error)
    return None, errors


def _leave(tasks: Sequence[asyncio.Task[T]], give_back: GiveBack[T] | None, grace_s: float) -> None:
    if tasks:
        _leaving.start(_left(tasks, give_back, grace_s))


async def _left(tasks: Sequence[asyncio.Task[T]], give_back: GiveBack[T] | None, grace_s: float) -> None:
    try:
        await asyncio.wait(tasks, timeout=grace_s)
    finally:
        for task in tasks:
            task.cancel()
    for result in await asyncio.gather(*tasks, return_exceptions=True):
        if give_back is not None and not isinstance(result, BaseException):
            await give_back(result)
