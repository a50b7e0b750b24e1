"""The sockets on which sensors listen: an address from the configuration, a buffer for bursts, a wait that ends."""

from __future__ import annotations

import ipaddress
import logging
import socket
from urllib.parse import urlsplit

_log = logging.getLogger(__name__)

RECEIVE_TIMEOUT_S = 0.2
"""Longest wait for a datagram; a handler has 1.5 s to stop."""
MAX_DATAGRAM_BYTES = 65_535
_BUFFER_BYTES = 4 * 1024 * 1024
"""A cloud arrives in one burst; the system's default holds a fifth of a megabyte."""


def udp_address(source: str) -> tuple[str, int]:
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


def bound_socket(source: str, label: str) -> socket.socket:
    """A socket that listens at ``source`` and whose ``recvfrom`` raises :class:`TimeoutError` in time for a stop.
    Raises :class:`OSError` that names the port."""
    host, port = udp_address(source)
    receiver = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_DGRAM)
    try:
        receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER_BYTES)
        receiver.bind((host, port))
    except OSError as error:
        receiver.close()
        raise OSError(error.errno, f"can't listen on UDP {host} port {port}: {error.strerror}") from error
    receiver.settimeout(RECEIVE_TIMEOUT_S)
    _log.info("%s: listens on UDP %s port %s", label, *receiver.getsockname()[:2])
    if not ipaddress.ip_address(host).is_loopback:
        _log.warning("%s: anybody who reaches %s can feed this sensor", label, host)
    return receiver
