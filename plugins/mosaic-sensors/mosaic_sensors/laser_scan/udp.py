"""The ``laser-scan`` connector: scans that other programs on the robot send by UDP, as JSON or in the compact form."""

from __future__ import annotations

import logging
import socket
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, ClassVar

from pydantic import Field, field_validator

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.words.errors import WireError
from mosaic_sensors.laser_scan.compact_form import MAGIC, decoded_scan
from mosaic_sensors.laser_scan.scan import Scan, scan_of_json
from mosaic_sensors.laser_scan.sender import LaserScanParams, LaserScanSender
from mosaic_sensors.udp_json import parsed_object
from mosaic_sensors.udp_socket import MAX_DATAGRAM_BYTES, bound_socket, udp_address

_log = logging.getLogger(__name__)


class UdpLaserScanParams(LaserScanParams):
    source: str = Field(min_length=1, description="udp://address:port, where scans arrive, one per datagram.")
    frame_id: str = Field(default="", max_length=64, description="The coordinate frame of the scanner.")

    @field_validator("source")
    @classmethod
    def _address(cls, source: str) -> str:
        udp_address(source)
        return source


def read_scan(datagram: bytes, now_s: float) -> Scan:
    """Raises :class:`ValueError` that says what is wrong with it."""
    if not datagram.startswith(MAGIC):
        return scan_of_json(parsed_object(datagram), now_s)
    try:
        scan = decoded_scan(datagram)
    except WireError as error:
        raise ValueError(str(error)) from None
    return replace(scan, captured_at_s=now_s)


class UdpLaserScan(LaserScanSender):
    """One scan per datagram. What is none is counted in :attr:`malformed` and logged once."""

    def __init__(self, label: str, params: UdpLaserScanParams) -> None:
        super().__init__(label, params)
        self.params = params
        self.malformed = 0
        self.address: tuple[str, int] | None = None
        """Where it listens, while it does."""

    def scans(self) -> Iterator[Scan]:
        with bound_socket(self.params.source, self.label) as receiver:
            self.address = receiver.getsockname()[:2]
            while not self.is_stopping:
                scan = self._received(receiver)
                if scan is not None:
                    yield scan

    def _received(self, receiver: socket.socket) -> Scan | None:
        try:
            datagram, sender = receiver.recvfrom(MAX_DATAGRAM_BYTES)
        except TimeoutError:
            return None
        try:
            return replace(read_scan(datagram, self.monotonic_s()), frame_id=self.params.frame_id)
        except ValueError as error:
            self.malformed += 1
            if self.malformed == 1:
                _log.warning("%s: refused a datagram of %s:%s: %s", self.label, sender[0], sender[1], error)
            return None


class LaserScanConfigurer(DataChannelConfigurer[UdpLaserScanParams]):
    """Laser scans that other programs on the robot send by UDP."""

    connector_type = "laser-scan"
    example: ClassVar[dict[str, Any] | None] = {"source": "udp://127.0.0.1:9011"}

    def configure(self) -> UdpLaserScan:
        return UdpLaserScan(self.label, self.params)
