"""One socket after the other: when the network is another one, the socket that it leaves behind is not waited for."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

from mosaic_core.runtime.timing.background_tasks import BackgroundTasks
from mosaic_core.runtime.transport.transport import TextSocket


class SocketRenewal:
    """Replaces a socket by a new one when the network changes. Event loop only. ``close`` says good-bye on a socket,
    which may take as long as it likes.
    """

    def __init__(self, close: Callable[[TextSocket], Coroutine[Any, Any, None]]) -> None:
        self._close = close
        self._asked = asyncio.Event()
        self._farewells = BackgroundTasks()

    @property
    def is_due(self) -> bool:
        """Asked for, and not yet begun."""
        return self._asked.is_set()

    def ask(self) -> None:
        """The network is another one: leave the socket, which may be dead without knowing it; make a new one now."""
        self._asked.set()

    async def opened(self, opening: Coroutine[Any, Any, TextSocket]) -> TextSocket | None:
        """The new socket; ``None``: the network changed before it was there. Raises what ``opening`` raises."""
        self._asked.clear()
        task, is_there = asyncio.create_task(opening), False
        try:
            is_there = await self.until_done(task)
        finally:
            if not is_there:
                task.cancel()
                task.add_done_callback(self._leave_late)
        return task.result() if is_there else None

    async def until_done(self, *tasks: asyncio.Task[Any]) -> bool:
        """Until one of them is done; ``False``: the network changed before. Cancelled, it cancels them."""
        asked = asyncio.create_task(self._asked.wait())
        try:
            await asyncio.wait({asked, *tasks}, return_when=asyncio.FIRST_COMPLETED)
        except asyncio.CancelledError:
            for task in tasks:
                task.cancel()
            raise
        finally:
            asked.cancel()
        return any(task.done() for task in tasks)

    def leave(self, socket: TextSocket) -> None:
        """Without waiting for it: whoever is out of reach answers nothing."""
        self._farewells.start(self._close(socket))

    async def all_left(self) -> None:
        """Until the last good-bye is said."""
        await self._farewells.done()

    def _leave_late(self, opening: asyncio.Task[TextSocket]) -> None:
        """It may have opened in the very moment in which nobody wanted it any more."""
        if not opening.cancelled() and opening.exception() is None:
            self.leave(opening.result())
