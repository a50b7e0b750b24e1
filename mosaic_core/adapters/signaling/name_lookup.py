"""Host names to addresses, on a daemon thread each.

asyncio resolves names on the executor that also encodes pictures, and joins it at exit: one dead name server would
freeze the video and hold up the shutdown.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import threading

from mosaic_core.machines.diagnosis.host_addresses import tried_addresses


async def ipv4_addresses(host: str) -> list[str]:
    """Those IPv4 addresses of ``host`` that are worth a try, never none; raises :class:`OSError`."""
    return tried_addresses(await _look_up(host, socket.AF_INET))


async def addresses_of(host: str) -> list[str]:
    """Likewise of both families: the first may lead nowhere, so try all at the same time."""
    return tried_addresses(await _look_up(host, socket.AF_UNSPEC))


async def _look_up(host: str, family: int) -> list[str]:
    loop = asyncio.get_running_loop()
    found: asyncio.Future[list[str]] = loop.create_future()

    def tell(result: list[str] | OSError) -> None:
        if found.done():
            return
        if isinstance(result, OSError):
            found.set_exception(result)
        else:
            found.set_result(result)

    def look_up() -> None:
        result: list[str] | OSError
        try:
            result = [str(one[4][0]) for one in socket.getaddrinfo(host, None, family, socket.SOCK_DGRAM)]
        except OSError as error:
            result = error
        with contextlib.suppress(RuntimeError):  # the loop is gone: nobody asks any more
            loop.call_soon_threadsafe(tell, result)

    threading.Thread(target=look_up, name=f"look-up-{host}", daemon=True).start()
    return await found
