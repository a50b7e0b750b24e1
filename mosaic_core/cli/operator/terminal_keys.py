"""A terminal that hands over every key at once, and is as before afterwards, whatever happens."""

from __future__ import annotations

import asyncio
import os
import sys
import termios
import tty
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager

from mosaic_core.cli.operator.drive_keys import ESCAPE_WAIT_S, Key, KeyReader


@asynccontextmanager
async def terminal_keys(pressed: Callable[[Key], None], file_descriptor: int | None = None) -> AsyncIterator[None]:
    """Call ``pressed`` on the event loop for every key of the terminal (stdin) within the block.

    Its end counts as ``quit``. The terminal's settings come back at the end of the block.
    """
    fd = sys.stdin.fileno() if file_descriptor is None else file_descriptor
    loop, reader = asyncio.get_running_loop(), KeyReader()
    timers: list[asyncio.TimerHandle] = []

    def flush() -> None:
        for key in reader.flush():
            pressed(key)

    def readable() -> None:
        while timers:
            timers.pop().cancel()
        data = os.read(fd, 1024)
        if not data:
            loop.remove_reader(fd)
            pressed("quit")
            return
        for key in reader.feed(data):
            pressed(key)
        if reader.is_waiting:
            timers.append(loop.call_later(ESCAPE_WAIT_S, flush))

    before = termios.tcgetattr(fd)
    try:
        tty.setcbreak(fd)
        loop.add_reader(fd, readable)
        yield
    finally:
        loop.remove_reader(fd)
        while timers:
            timers.pop().cancel()
        termios.tcsetattr(fd, termios.TCSADRAIN, before)
