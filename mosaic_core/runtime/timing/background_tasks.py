"""Keeps the asyncio tasks that one object started, so that none is collected before it is done."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import Any


class BackgroundTasks:
    """Starts tasks nobody waits for, and ends them together. Event loop only."""

    def __init__(self) -> None:
        self._tasks: set[asyncio.Task[None]] = set()

    def start(self, work: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        """Run ``work`` beside everything else; what it raises is logged by asyncio."""
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    def cancel(self) -> None:
        """End what still runs, except the task that asks for it."""
        for task in self._tasks - {asyncio.current_task()}:
            task.cancel()

    async def done(self) -> None:
        """Wait until none is left, also of those that they start meanwhile."""
        while self._tasks:
            await asyncio.wait(self._tasks)
