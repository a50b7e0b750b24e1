"""Reads bytes from where they come, and writes them there: a serial port, a TCP server, or a device that is made up.
A read returns in time for a stop to be noticed, a write in time for a safe action."""

from __future__ import annotations

import errno
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Annotated, Protocol, TypeAlias
from urllib.parse import urlsplit

import serial
from pydantic import AfterValidator

READ_TIMEOUT_S = 0.2
"""Longest read without data; a handler has 1.5 s to stop."""
CONNECT_TIMEOUT_S = 1.0
"""A dead address must not keep the robot from stopping; the runner tries again anyway."""
WRITE_TIMEOUT_S = 0.2
"""A line that takes nothing any more must not hold up whoever makes the robot safe."""
READ_BYTES = 4096
FAKE = "fake"
"""The source that is a device made up, to try a connector without one."""


class ByteSource(Protocol):
    def read(self) -> bytes:
        """What has arrived; empty after ``READ_TIMEOUT_S`` of silence. Raises :class:`OSError` when it is lost."""
        ...

    def write(self, data: bytes) -> None:
        """Hand all of ``data`` over. Raises :class:`OSError` when it is lost, or takes nothing for
        ``WRITE_TIMEOUT_S``. Any thread, one at a time."""
        ...

    def set_dtr(self, is_on: bool) -> None:
        """Switch the line DTR, where there is one. Raises :class:`OSError` when the port is lost."""
        ...


class SerialSource:
    def __init__(self, port: serial.Serial) -> None:
        self._port = port

    def read(self) -> bytes:
        return self._port.read(max(1, min(self._port.in_waiting, READ_BYTES)))

    def write(self, data: bytes) -> None:
        self._port.write(data)

    def set_dtr(self, is_on: bool) -> None:
        try:
            self._port.dtr = is_on
        except OSError as error:
            if error.errno not in (errno.EINVAL, errno.ENOTTY):  # a pseudo terminal, or a cable of three wires
                raise


class TcpSource:
    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection

    def read(self) -> bytes:
        try:
            data = self._connection.recv(READ_BYTES)
        except TimeoutError:
            return b""
        if not data:
            raise ConnectionError("the other side closed the connection")
        return data

    def write(self, data: bytes) -> None:
        self._connection.sendall(data)

    def set_dtr(self, is_on: bool) -> None:
        """A connection has none."""


class FakeSource:
    """Says ``pieces``: each a pause in seconds and the bytes after it. ``pause`` is the handler's, so that a stop ends
    it and tests wait for nobody. ``hears`` gets what is written."""

    def __init__(
        self,
        pieces: Iterator[tuple[float, bytes]],
        pause: Callable[[float], bool],
        hears: Callable[[bytes], None] = lambda data: None,
    ) -> None:
        self._pieces = pieces
        self._pause = pause
        self._hears = hears

    def read(self) -> bytes:
        pause_s, data = next(self._pieces)
        return b"" if self._pause(pause_s) else data

    def write(self, data: bytes) -> None:
        self._hears(data)

    def set_dtr(self, is_on: bool) -> None:
        """What is made up has none."""


def tcp_address(source: str) -> tuple[str, int]:
    """Host and port of ``tcp://host:port``. Raises :class:`ValueError`."""
    parts = urlsplit(source)
    if parts.hostname is None or parts.port is None or parts.path or parts.query:
        raise ValueError(f"{source!r} is no address; write tcp://host:port")
    return parts.hostname, parts.port


def is_tcp(source: str) -> bool:
    return source.startswith("tcp://")


def is_serial(source: str) -> bool:
    return source.startswith(("/dev/", "COM"))


def _live_source(source: str) -> str:
    if is_tcp(source):
        tcp_address(source)
    elif not is_serial(source) and source != FAKE:
        raise ValueError(f"{source!r} is no source; write a serial port (/dev/ttyUSB0), tcp://host:port, or {FAKE}")
    return source


LiveSource: TypeAlias = Annotated[str, AfterValidator(_live_source)]
"""Names something that can be opened."""


def baud_doubt(source: str, baud: int) -> str:
    """The end of a complaint about what a serial port says, or does not say."""
    return f"; is {baud} the right baud rate?" if is_serial(source) else ""


@contextmanager
def opened(source: str, baud: int, fake: Callable[[], ByteSource] | None = None) -> Iterator[ByteSource]:
    """The open source; ``fake`` makes the one that is made up. Raises :class:`OSError` (:class:`serial.SerialException`
    is one) if it can't be opened."""
    if source == FAKE and fake is not None:
        yield fake()
    elif is_tcp(source):
        with socket.create_connection(tcp_address(source), timeout=CONNECT_TIMEOUT_S) as connection:
            connection.settimeout(READ_TIMEOUT_S)
            yield TcpSource(connection)
    else:
        with serial.Serial(
            source, baud, timeout=READ_TIMEOUT_S, write_timeout=WRITE_TIMEOUT_S, exclusive=True
        ) as port:  # exclusive: of two readers each would get a part of the bytes
            yield SerialSource(port)
