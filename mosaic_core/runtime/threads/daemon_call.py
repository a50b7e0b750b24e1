"""Calls a function that may never return, on a thread that nobody waits for: the loop's own threads are joined when it
ends."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from functools import partial
from typing import TypeVar

from mosaic_core.runtime.threads.handover import on_loop

T = TypeVar("T")


async def called_on_daemon(function: Callable[[], T], name: str) -> T:
    """What ``function`` returns or raises, called on a thread of its own of this ``name``; event loop."""
    loop = asyncio.get_running_loop()
    done: asyncio.Future[T] = loop.create_future()

    def settle(act: Callable[[], None]) -> None:
        if not done.done():
            act()

    def call() -> None:
        try:
            act = partial(done.set_result, function())
        except BaseException as error:  # noqa: BLE001 - whoever waits is told
            act = partial(done.set_exception, error)
        on_loop(loop, partial(settle, act))

    threading.Thread(target=call, name=name, daemon=True).start()
    return await done
