"""The sockets on which sensors listen: an address from the configuration, a buffer for bursts, a wait that ends, and a
count of whatever does not become a measurement.
"""

from __future__ import annotations

import ipaddress
import logging
import socket
import struct
import sys
from typing import Self, TypeAlias
from urllib.parse import urlsplit

from mosaic_core.contract.devices.refused_input import RefusedInput
from mosaic_core.contract.handler import Handler
from mosaic_core.machines.timing.pacing import ComplaintPace
from mosaic_core.words.errors import DeviceGone

_log = logging.getLogger(__name__)

RECEIVE_TIMEOUT_S = 0.2
"""Longest wait for a datagram; a handler has 1.5 s to stop."""
MAX_DATAGRAM_BYTES = 65_535
_BUFFER_BYTES = 4 * 1024 * 1024
"""A cloud arrives in one burst; the system's default holds a fifth of a megabyte."""
_LOOK_EVERY = 64
"""Datagrams, after which the kernel is asked what it dropped; in silence it is asked each time."""
_MEMORY_INFO = struct.Struct("9I")
"""What Linux tells of a socket's memory (``linux/sock_diag.h``); the last number: datagrams without room."""
_SO_MEMINFO = 55
"""``asm-generic/socket.h``, since Linux 4.12; Python has no name for it."""

Address: TypeAlias = tuple[str, int]


def udp_address(source: str) -> Address:
    """Address and port of ``udp://address:port``. Raises :class:`ValueError`."""
    wrong = f"{source!r} is no address to listen on; write udp://127.0.0.1:9010"
    try:
        parts = urlsplit(source)
        address, port = ipaddress.ip_address(parts.hostname or ""), parts.port
    except ValueError:
        raise ValueError(wrong) from None
    if parts.scheme != "udp" or port is None or parts.path or parts.query:
        raise ValueError(wrong)
    return str(address), port


class Datagrams:
    """Receives the datagrams for ``handler`` at ``listens_at``: listens while it is entered, again and again if need
    be. On the handler's own thread.

    What is refused, and what the kernel dropped because its buffer was full, is counted for the handler's connector.
    """

    def __init__(self, handler: Handler, listens_at: Address, max_bytes: int = MAX_DATAGRAM_BYTES) -> None:
        self.address: Address | None = None
        """Where it listens, or did last: with the port that was found for 0."""
        self._handler = handler
        self._listens_at = listens_at
        self._max_bytes = max_bytes
        self._refusals = RefusedInput(handler)
        self._overflows = ComplaintPace()
        self._socket: socket.socket | None = None
        self._received = 0
        self._overflowed = 0

    def __enter__(self) -> Self:
        """Raises :class:`DeviceGone` that names the port."""
        self._socket = receiver = _bound(*self._listens_at)
        self._received = self._overflowed = 0
        self.address = receiver.getsockname()[:2]
        _log.info("%s: listens on UDP %s port %s", self._handler.label, *receiver.getsockname()[:2])
        if not ipaddress.ip_address(self._listens_at[0]).is_loopback:
            _log.warning("%s: anybody who reaches %s can feed this sensor", self._handler.label, self._listens_at[0])
        return self

    def __exit__(self, *_: object) -> None:
        assert self._socket is not None
        self._count_overflow(self._socket)
        self._socket.close()
        self._socket = None

    def next(self) -> tuple[bytes, Address] | None:
        """The next datagram and who sent it; ``None`` after :data:`RECEIVE_TIMEOUT_S` of silence. Of one that is
        larger than ``max_bytes`` one byte more than that comes."""
        assert self._socket is not None
        try:
            datagram, sender = self._socket.recvfrom(self._max_bytes + 1)
        except TimeoutError:
            self._count_overflow(self._socket)
            return None
        self._received += 1
        if self._received % _LOOK_EVERY == 0:
            self._count_overflow(self._socket)
        return datagram, sender[:2]

    def refuse(self, sender: Address, error: ValueError) -> None:
        """The datagram can't be used: counted each time, logged once in a while."""
        self._refusals.add(f"a datagram of {sender[0]}:{sender[1]}", error)

    def _count_overflow(self, receiver: socket.socket) -> None:
        overflowed = _overflowed(receiver)
        if overflowed == self._overflowed:
            return
        self._handler.count_loss("dropped", (overflowed - self._overflowed) % (1 << 32))
        self._overflowed = overflowed
        if self._overflows.is_due("overflow", self._handler.monotonic_s()):
            _log.warning(
                "%s: datagrams come faster than they are read; %d are lost so far", self._handler.label, overflowed
            )


def _bound(host: str, port: int) -> socket.socket:
    receiver = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_DGRAM)
    try:
        receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER_BYTES)
        receiver.bind((host, port))
    except OSError as error:
        receiver.close()
        raise DeviceGone(f"can't listen on UDP {host} port {port}: {error.strerror}") from error
    receiver.settimeout(RECEIVE_TIMEOUT_S)
    return receiver


def _overflowed(receiver: socket.socket) -> int:
    """How many datagrams found no room in the socket's buffer; 0 where the system does not tell."""
    if sys.platform != "linux":
        return 0
    try:
        return int(_MEMORY_INFO.unpack(receiver.getsockopt(socket.SOL_SOCKET, _SO_MEMINFO, _MEMORY_INFO.size))[-1])
    except (OSError, struct.error):
        return 0
