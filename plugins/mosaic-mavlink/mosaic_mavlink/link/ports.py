"""What carries the bytes of a link: UDP, TCP or a serial line. Each port is read by the link's thread alone, and
written by any; what can't be written at once is left out, as on a radio.
"""

from __future__ import annotations

import contextlib
import select
import socket
from typing import Protocol

from mosaic_mavlink.link.address import Source

CONNECT_TIMEOUT_S = 2.0
MAX_READ_BYTES = 65_536
_BUSY = (BlockingIOError, InterruptedError)


class Port(Protocol):
    """One open way to vehicles."""

    def read(self, timeout_s: float) -> tuple[bytes, Source]:
        """What came, and from where; nothing after ``timeout_s``. Raises :class:`OSError` when it is lost."""

    def write(self, data: bytes, to: Source) -> None:
        """Send now or not at all. Raises :class:`OSError` when it is lost."""

    def close(self) -> None:
        """Let the device go."""


class UdpPort:
    """Reads and writes datagrams. ``remote``: whom it sends to until somebody was heard."""

    def __init__(self, local: tuple[str, int] | None, remote: tuple[str, int] | None) -> None:
        where = local or remote
        assert where is not None
        family, kind, protocol, _, address = socket.getaddrinfo(*where, type=socket.SOCK_DGRAM)[0]
        self._socket = socket.socket(family, kind, protocol)
        try:
            if local is not None:
                self._socket.bind(address)
        except OSError:
            self._socket.close()
            raise
        self._remote: Source = address if remote is not None else None
        self._socket.setblocking(False)

    @property
    def address(self) -> tuple[str, int]:
        """Where it listens."""
        name = self._socket.getsockname()
        return name[0], name[1]

    def read(self, timeout_s: float) -> tuple[bytes, Source]:
        if not select.select([self._socket], [], [], timeout_s)[0]:
            return b"", None
        try:
            return self._socket.recvfrom(MAX_READ_BYTES)
        except (*_BUSY, ConnectionRefusedError):
            return b"", None  # nobody listens there yet: a vehicle that boots is no loss of the link

    def write(self, data: bytes, to: Source) -> None:
        target = to or self._remote
        if target is not None:
            with contextlib.suppress(*_BUSY, ConnectionRefusedError):
                self._socket.sendto(data, target)

    def close(self) -> None:
        self._socket.close()


class TcpPort:
    """Reads and writes a stream to a simulator or a bridge."""

    def __init__(self, host: str, port: int) -> None:
        self._socket = socket.create_connection((host, port), CONNECT_TIMEOUT_S)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket.settimeout(CONNECT_TIMEOUT_S)

    def read(self, timeout_s: float) -> tuple[bytes, Source]:
        if not select.select([self._socket], [], [], timeout_s)[0]:
            return b"", None
        data = self._socket.recv(MAX_READ_BYTES)
        if not data:
            raise ConnectionResetError("the other end closed the connection")
        return data, None

    def write(self, data: bytes, to: Source) -> None:
        if select.select([], [self._socket], [], 0)[1]:
            self._socket.sendall(data)

    def close(self) -> None:
        self._socket.close()


class SerialPort:
    """Reads and writes a serial line: a flight controller's USB, or a telemetry radio."""

    def __init__(self, name: str, baud: int) -> None:
        import serial

        self._line = serial.Serial(name, baud, timeout=0.05, write_timeout=0.5, exclusive=True)

    def read(self, timeout_s: float) -> tuple[bytes, Source]:
        self._line.timeout = timeout_s
        first = self._line.read(1)
        return first + self._line.read(min(self._line.in_waiting, MAX_READ_BYTES)), None

    def write(self, data: bytes, to: Source) -> None:
        self._line.write(data)

    def close(self) -> None:
        self._line.close()
