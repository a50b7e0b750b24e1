"""Accepts connections for uvicorn: counted by address before anything is read, handshakes of TLS with a short time-out.

uvicorn would listen by itself and count nothing; where file descriptors run out it can't accept anybody any more.
"""

from __future__ import annotations

import asyncio
import logging
import socket
import ssl
from collections.abc import Callable
from itertools import chain

from mosaic_server.entrance.entrance import Entrance
from mosaic_server.entrance.places import EntrancePlace

_log = logging.getLogger(__name__)

BACKLOG = 2048
"""Of connections that the kernel holds until they are accepted; uvicorn's own number."""
_PAUSE_S = 0.1


def bound_sockets(host: str, port: int) -> list[socket.socket]:
    """Sockets at every address of ``host``; raises :class:`OSError`."""
    found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    places = dict.fromkeys((family, address) for family, _, _, _, address in found)
    return [socket.create_server(address, family=family, backlog=BACKLOG) for family, address in places]


class CountingListener:
    """Accepts on bound sockets from its making until it is closed; what uvicorn asks of an ``asyncio.Server``.

    ``make_protocol``: called with the place of each admitted connection. Event-loop thread only.
    """

    def __init__(
        self,
        sockets: list[socket.socket],
        entrance: Entrance,
        make_protocol: Callable[[EntrancePlace], asyncio.Protocol],
        tls: ssl.SSLContext | None,
    ) -> None:
        self.sockets = sockets
        self._entrance = entrance
        self._make_protocol = make_protocol
        self._tls = tls
        self._accepting = [asyncio.create_task(self._accept(one)) for one in sockets]
        self._beginning: set[asyncio.Task[None]] = set()

    def close(self) -> None:
        for task in chain(self._accepting, self._beginning):
            task.cancel()

    async def wait_closed(self) -> None:
        await asyncio.gather(*self._accepting, *self._beginning, return_exceptions=True)
        for one in self.sockets:
            one.close()

    async def _accept(self, listening: socket.socket) -> None:
        loop = asyncio.get_running_loop()
        listening.setblocking(False)
        is_failing = False
        while True:
            try:
                connection, peer = await loop.sock_accept(listening)
                is_failing = False
            except OSError as error:  # one who was gone again, or no file descriptor is left
                if not is_failing:
                    _log.error("a connection could not be accepted: %s", error)
                is_failing = True
                await asyncio.sleep(_PAUSE_S)
            else:
                self._admit(connection, str(peer[0]))

    def _admit(self, connection: socket.socket, address: str) -> None:
        place = self._entrance.take(address)
        if place is None:
            connection.close()
            return
        beginning = asyncio.create_task(self._begin(connection, place))
        place.close = beginning.cancel
        self._beginning.add(beginning)
        beginning.add_done_callback(self._beginning.discard)

    async def _begin(self, connection: socket.socket, place: EntrancePlace) -> None:
        """What ends a handshake is no news: scanners do, and browsers that don't trust the certificate."""
        within_s = None if self._tls is None else self._entrance.bounds.header_s
        try:
            await asyncio.get_running_loop().connect_accepted_socket(
                lambda: self._make_protocol(place), connection, ssl=self._tls, ssl_handshake_timeout=within_s
            )
        except OSError:
            self._entrance.leave(place)
        except asyncio.CancelledError:
            self._entrance.leave(place)
            raise
