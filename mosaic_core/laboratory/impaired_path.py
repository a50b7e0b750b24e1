"""A bad network between a robot and its operators, without root: a UDP relay in user space that delays, drops,
reorders and throttles real packets.

The relay stands in front of the robot like a router, see :mod:`mosaic_core.laboratory.impaired_answerer`. It has a
thread of its own, so that a busy event loop doesn't look like a bad network.
"""

from __future__ import annotations

import heapq
import itertools
import selectors
import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Self

from mosaic_core.laboratory.impairment import Impairment
from mosaic_core.machines.laboratory.impaired_link import ImpairedLink, LinkProfile

SocketAddress = tuple[Any, ...]
_READ_BYTES = 65536
_BURST = 64
"""Packets taken from one socket before the others have their turn."""
_SOCKET_BYTES = 4 * 1024 * 1024


class ImpairedPath(Impairment):
    """Impairs one network for all peers that are relayed over it; ``with`` runs it. ``seed`` makes losses repeatable.

    :attr:`up` (towards the robot) and :attr:`down` may be changed while it runs, from any thread.
    """

    def __init__(self, profile: LinkProfile | str = "pristine", *, seed: int = 1) -> None:
        super().__init__(profile, seed=seed)
        self._selector = selectors.DefaultSelector()
        self._due: list[tuple[float, int, Callable[[], object]]] = []
        self._number = itertools.count()
        self.lock = threading.Lock()
        self._opened: list[tuple[socket.socket, Callable[[], None]]] = []
        self._wake_read, self._wake_write = socket.socketpair()
        self._is_closing = False
        self._thread = threading.Thread(target=self._serve, name="mosaic-impaired-path", daemon=True)

    def __enter__(self) -> Self:
        self._wake_read.setblocking(False)
        self._selector.register(self._wake_read, selectors.EVENT_READ, self._woken)
        self._thread.start()
        return self

    def __exit__(self, *exception: object) -> None:
        self._is_closing = True
        self._wake()
        self._thread.join()
        self._adopt()  # what was opened last has to be closed too
        for key in list(self._selector.get_map().values()):
            key.fileobj.close()  # type: ignore[union-attr] # only sockets are registered
        self._selector.close()
        self._wake_write.close()

    def relayed(self, host: str, port: int) -> tuple[str, int]:
        """The address that stands for ``host:port`` from now on. Any thread; raises :class:`OSError`."""
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        front = _Front(self, bound_socket(family, host), (host, port))
        self.open(front.socket, front.read)
        return host, front.port

    def open(self, sock: socket.socket, read: Callable[[], None]) -> None:
        """Call ``read()`` on the relay's thread when something has come, until the path closes. Any thread."""
        with self.lock:
            self._opened.append((sock, read))
        self._wake()

    # -- the relay's thread --------------------------------------------------------------------------------------

    def listen(self, sock: socket.socket, read: Callable[[], None]) -> None:
        self._selector.register(sock, selectors.EVENT_READ, read)

    def carry(self, link: ImpairedLink, data: bytes, send: Callable[[bytes], object]) -> None:
        """Deliver ``data`` when ``link`` says, if it does."""
        arrival_s = self.arrival_s(link, len(data), time.monotonic())
        if arrival_s is not None:
            heapq.heappush(self._due, (arrival_s, next(self._number), lambda: send(data)))

    def _serve(self) -> None:
        while not self._is_closing:
            for key, _ in self._selector.select(self._patience_s()):
                key.data()
            now_s = time.monotonic()
            while self._due and self._due[0][0] <= now_s:
                with suppress(OSError):  # a port that closed meanwhile, as on a real network
                    heapq.heappop(self._due)[2]()

    def _patience_s(self) -> float | None:
        return max(0.0, self._due[0][0] - time.monotonic()) if self._due else None

    def _wake(self) -> None:
        self._wake_write.send(b"\0")

    def _woken(self) -> None:
        self._wake_read.recv(_READ_BYTES)
        self._adopt()

    def _adopt(self) -> None:
        with self.lock:
            opened, self._opened = self._opened, []
        for sock, read in opened:
            self.listen(sock, read)


class _Front:
    """Relays one address of the robot: a socket that operators see, and one towards the robot for each of them."""

    def __init__(self, path: ImpairedPath, sock: socket.socket, robot: SocketAddress) -> None:
        self._path = path
        self.socket = sock
        self._robot = robot
        self._backs: dict[SocketAddress, socket.socket] = {}
        self.port: int = sock.getsockname()[1]

    def read(self) -> None:
        for data, operator in received(self.socket):
            back = self._backs.get(operator) or self._open_back(operator)
            self._path.carry(self._path.up, data, lambda data, back=back: back.sendto(data, self._robot))  # type: ignore[misc]

    def _open_back(self, operator: SocketAddress) -> socket.socket:
        back = self._backs[operator] = bound_socket(self.socket.family, self._robot[0])
        self._path.listen(back, lambda: self._read_back(back, operator))
        return back

    def _read_back(self, back: socket.socket, operator: SocketAddress) -> None:
        for data, _ in received(back):
            self._path.carry(self._path.down, data, lambda data: self.socket.sendto(data, operator))


def bound_socket(family: socket.AddressFamily | int, host: str) -> socket.socket:
    """A UDP socket on a free port of ``host``, with room for bursts."""
    sock = socket.socket(family, socket.SOCK_DGRAM)
    sock.setblocking(False)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _SOCKET_BYTES)
    sock.bind((host, 0))
    return sock


def received(sock: socket.socket) -> list[tuple[bytes, SocketAddress]]:
    """What has come, with whose it is."""
    packets: list[tuple[bytes, SocketAddress]] = []
    with suppress(BlockingIOError, ConnectionRefusedError):
        while len(packets) < _BURST:
            packets.append(sock.recvfrom(_READ_BYTES))
    return packets
