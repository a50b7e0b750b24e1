"""Reads NMEA lines from where they come: a serial port or a TCP server. A read returns in time for a stop to be
noticed."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol
from urllib.parse import urlsplit

import serial

READ_TIMEOUT_S = 0.2
"""Longest read without data; a handler has 1.5 s to stop."""
CONNECT_TIMEOUT_S = 1.0
"""A dead address must not keep the robot from stopping; the runner tries again anyway."""
READ_BYTES = 4096


class ByteSource(Protocol):
    def read(self) -> bytes:
        """What has arrived; empty after ``READ_TIMEOUT_S`` of silence. Raises :class:`OSError` when it is lost."""
        ...


class SerialSource:
    def __init__(self, port: serial.Serial) -> None:
        self._port = port

    def read(self) -> bytes:
        return self._port.read(max(1, min(self._port.in_waiting, READ_BYTES)))


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


@contextmanager
def opened(source: str, baud: int) -> Iterator[ByteSource]:
    """The open source. Raises :class:`OSError` (:class:`serial.SerialException` is one) if it can't be opened."""
    if is_tcp(source):
        with socket.create_connection(tcp_address(source), timeout=CONNECT_TIMEOUT_S) as connection:
            connection.settimeout(READ_TIMEOUT_S)
            yield TcpSource(connection)
    else:
        with serial.Serial(source, baudrate=baud, timeout=READ_TIMEOUT_S) as port:
            yield SerialSource(port)
