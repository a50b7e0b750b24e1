"""The ``udp-json`` connector: JSON objects that any process on the robot sends to a UDP port become messages."""

from __future__ import annotations

import ipaddress
from collections.abc import Iterator
from typing import Any, ClassVar

from pydantic import Field, IPvAnyAddress

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import DataChannelSendable
from mosaic_core.contract.params import Params
from mosaic_core.words.wire_model import parsed_object
from mosaic_sensors.udp_socket import Address, Datagrams


class UdpJsonParams(Params):
    port: int = Field(ge=0, le=65_535, description="UDP port; 0 takes a free one, which the log tells.")
    host: IPvAnyAddress = Field(
        default=ipaddress.IPv4Address("127.0.0.1"),
        validate_default=True,
        description="Address to listen on; anything but loopback lets the network feed this sensor.",
    )
    max_bytes: int = Field(default=16_384, ge=2, le=65_507, description="Larger datagrams are refused.")


class UdpJson(DataChannelSendable[Any]):
    """Sends a JSON message per datagram. What is no JSON object counts as refused."""

    def __init__(self, label: str, params: UdpJsonParams) -> None:
        super().__init__(label)
        self.params = params
        self.datagrams = Datagrams(self, (str(params.host), params.port), params.max_bytes)

    def messages(self) -> Iterator[dict[str, Any]]:
        with self.datagrams:
            while not self.is_stopping:
                received = self.datagrams.next()
                message = self._read(*received) if received is not None else None
                if message is not None:
                    yield message

    def _read(self, datagram: bytes, sender: Address) -> dict[str, Any] | None:
        try:
            if len(datagram) > self.params.max_bytes:
                raise ValueError(f"larger than max_bytes ({self.params.max_bytes})")
            return parsed_object(datagram)
        except ValueError as error:
            self.datagrams.refuse(sender, error)
            return None


class UdpJsonConfigurer(DataChannelConfigurer[UdpJsonParams]):
    """JSON objects that other processes on the robot send to a UDP port."""

    connector_type = "udp-json"
    example: ClassVar[dict[str, Any] | None] = {"port": 9000}
    trial: ClassVar[dict[str, Any] | None] = {"port": 0}

    def configure(self) -> UdpJson:
        return UdpJson(self.label, self.params)
