"""Opens what carries the bytes of a link: UDP, TCP or a serial line. Each port is read by the link's thread alone, and
written by any; what can't be written at once is left out, as on a radio.
"""

from __future__ import annotations

import contextlib
import select
import socket
from typing import Any, Protocol, TypeAlias

from mosaic_core.words.errors import DeviceGone
from mosaic_mavlink.link.address import LinkAddress

Source: TypeAlias = tuple[Any, ...] | None
"""Where bytes came from; ``None`` where there is only one other end."""

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


def opened_port(address: LinkAddress, baud: int) -> Port:
    """Open the port of ``address``. Blocks for 2 s at most. Raises :class:`DeviceGone` that names it and the cure."""
    try:
        return _opened(address, baud)
    except (OSError, ValueError) as error:  # pyserial's errors are OSErrors, or ValueError for an impossible baud
        where = f"{address.host}:{address.port}" if address.port else address.host
        reason = getattr(error, "strerror", None) or str(error)
        raise DeviceGone(
            f"the MAVLink link {address.transport} {where} can't be opened: {reason}", _CURES[address.transport]
        ) from error


_CURES = {
    "udpin": "see whether another ground station listens on this port",
    "udpout": "check host name and network",
    "tcp": "start the simulator or bridge that listens there",
    "serial": "plug it in, see who else has it open, and whether this account is in the group dialout",
    "fake": "free a UDP port of this machine",
}


def _opened(address: LinkAddress, baud: int) -> Port:
    match address.transport:
        case "udpin":
            return UdpPort((address.host, address.port), None)
        case "udpout":
            return UdpPort(None, (address.host, address.port))
        case "tcp":
            return TcpPort(address.host, address.port)
        case "serial":
            return SerialPort(address.host, baud)
        case "fake":
            from mosaic_mavlink.fake.fake_port import FakePort

            return FakePort(address.host)
