"""The other end of a comparison without MOSAIC: a process of its own, joined to the bench by a pipe."""

from __future__ import annotations

import asyncio
import multiprocessing
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection
from typing import Any

END_S = 5.0


@contextmanager
def other_end(serve: Callable[[Connection], None]) -> Iterator[Connection]:
    """Our end of the pipe; ``serve``, a function of a module, has the other one and ends when it closes."""
    spawn = multiprocessing.get_context("spawn")
    ours, theirs = spawn.Pipe()
    process = spawn.Process(target=serve, args=(theirs,), daemon=True)
    process.start()
    theirs.close()
    try:
        yield ours
    finally:
        ours.close()
        process.join(timeout=END_S)
        if process.is_alive():
            process.kill()
            process.join()


async def next_call(pipe: Connection) -> Any:
    """What the bench wants next; ``None``: nothing any more."""
    try:
        return await asyncio.to_thread(pipe.recv)
    except (EOFError, ConnectionResetError):
        return None
