"""Host names to addresses, on a daemon thread each.

asyncio resolves names on the executor that also encodes pictures, and joins it at exit: one dead name server would
freeze the video and hold up the shutdown.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import threading
from typing import Any

Found = list[tuple[Any, ...]]


async def ipv4_of(host: str) -> str:
    """The first IPv4 address of ``host``; raises :class:`OSError`."""
    return str((await _look_up(host, socket.AF_INET))[0][4][0])


async def address_of(host: str) -> str:
    """The first address of ``host``, IPv4 or IPv6; raises :class:`OSError`."""
    return str((await _look_up(host, socket.AF_UNSPEC))[0][4][0])


async def _look_up(host: str, family: int) -> Found:
    loop = asyncio.get_running_loop()
    found: asyncio.Future[Found] = loop.create_future()

    def tell(result: Found | OSError) -> None:
        if found.done():
            return
        if isinstance(result, OSError):
            found.set_exception(result)
        else:
            found.set_result(result)

    def look_up() -> None:
        result: Found | OSError
        try:
            result = list(socket.getaddrinfo(host, None, family, socket.SOCK_DGRAM))
        except OSError as error:
            result = error
        with contextlib.suppress(RuntimeError):  # the loop is gone: nobody asks any more
            loop.call_soon_threadsafe(tell, result)

    threading.Thread(target=look_up, name=f"look-up-{host}", daemon=True).start()
    return await found
