"""The ``udp-json`` connector: JSON objects that any process on the robot sends to a UDP port become messages."""

from __future__ import annotations

import ipaddress
import json
import logging
import socket
from collections.abc import Iterator
from typing import Any, ClassVar

from pydantic import Field, IPvAnyAddress

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import DataChannelSendable
from mosaic_core.contract.params import Params
from mosaic_core.words.wire_model import to_json

_log = logging.getLogger(__name__)

RECEIVE_TIMEOUT_S = 0.2
"""Longest wait for a datagram; a handler has 1.5 s to stop."""
MAX_DEPTH = 32
"""Nesting beyond this is no measurement, and would make the encoder's recursion a way to stop the connector."""


class UdpJsonParams(Params):
    port: int = Field(ge=0, le=65_535, description="UDP port; 0 takes a free one, which the log tells.")
    host: IPvAnyAddress = Field(
        default=ipaddress.IPv4Address("127.0.0.1"),
        validate_default=True,
        description="Address to listen on; anything but loopback lets the network feed this sensor.",
    )
    max_bytes: int = Field(default=16_384, ge=2, le=65_507, description="Larger datagrams are refused.")


def parsed_object(datagram: bytes) -> dict[str, Any]:
    """The JSON object in ``datagram``. Raises :class:`ValueError` that says what is wrong with it.

    What comes back can be sent: finite numbers, valid Unicode, bounded depth.
    """
    try:
        value = json.loads(datagram)
    except RecursionError:
        raise ValueError(f"nested deeper than {MAX_DEPTH}") from None
    if not isinstance(value, dict):
        raise ValueError(f"a JSON {type(value).__name__} where an object is expected")
    if _is_deeper_than(MAX_DEPTH, value):
        raise ValueError(f"nested deeper than {MAX_DEPTH}")
    to_json(value).encode()
    return value


def _is_deeper_than(depth: int, value: Any) -> bool:
    layer = [value]
    for _ in range(depth):
        layer = [inner for outer in layer for inner in _children(outer)]
    return bool(layer)


def _children(value: Any) -> list[Any]:
    if isinstance(value, dict):
        return list(value.values())
    return value if isinstance(value, list) else []


class UdpJson(DataChannelSendable[dict[str, Any]]):
    """One message per datagram. What is no JSON object is counted in :attr:`malformed` and logged once."""

    def __init__(self, label: str, params: UdpJsonParams) -> None:
        super().__init__(label)
        self.params = params
        self.malformed = 0
        self.address: tuple[str, int] | None = None
        """Where it listens, while it does."""

    def messages(self) -> Iterator[dict[str, Any]]:
        with self._bound() as receiver:
            while not self.is_stopping:
                try:
                    datagram, sender = receiver.recvfrom(self.params.max_bytes + 1)
                except TimeoutError:
                    continue
                message = self._read(datagram, sender)
                if message is not None:
                    yield message

    def _bound(self) -> socket.socket:
        host, port = str(self.params.host), self.params.port
        family = socket.AF_INET6 if self.params.host.version == 6 else socket.AF_INET
        receiver = socket.socket(family, socket.SOCK_DGRAM)
        try:
            receiver.bind((host, port))
        except OSError as error:
            receiver.close()
            raise OSError(error.errno, f"can't listen on UDP {host} port {port}: {error.strerror}") from error
        receiver.settimeout(RECEIVE_TIMEOUT_S)
        name = receiver.getsockname()
        self.address = (name[0], name[1])
        _log.info("%s: listens on UDP %s port %s", self.label, *self.address)
        if not self.params.host.is_loopback:
            _log.warning("%s: anybody who reaches %s can feed this sensor", self.label, host)
        return receiver

    def _read(self, datagram: bytes, sender: tuple[Any, ...]) -> dict[str, Any] | None:
        try:
            if len(datagram) > self.params.max_bytes:
                raise ValueError(f"larger than max_bytes ({self.params.max_bytes})")
            return parsed_object(datagram)
        except ValueError as error:
            self.malformed += 1
            if self.malformed == 1:
                _log.warning("%s: refused a datagram of %s:%s: %s", self.label, sender[0], sender[1], error)
            return None


class UdpJsonConfigurer(DataChannelConfigurer[UdpJsonParams]):
    """JSON objects that other processes on the robot send to a UDP port."""

    connector_type = "udp-json"
    example: ClassVar[dict[str, Any] | None] = {"port": 9000}

    def configure(self) -> UdpJson:
        return UdpJson(self.label, self.params)
