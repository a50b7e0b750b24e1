"""The ``laser-scan`` connector: scans that other programs on the robot send by UDP, as JSON or in the compact form."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any, ClassVar

from pydantic import Field, field_validator

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.words.errors import WireError
from mosaic_core.words.wire_model import parsed_object
from mosaic_sensors.laser_scan.compact_form import MAGIC, decoded_scan
from mosaic_sensors.laser_scan.scan import Scan, scan_of_json
from mosaic_sensors.laser_scan.sender import LaserScanParams, LaserScanSender
from mosaic_sensors.udp_socket import Address, Datagrams, udp_address


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
    """Sends a laser scan per datagram. What is none counts as refused."""

    def __init__(self, label: str, params: UdpLaserScanParams) -> None:
        super().__init__(label, params)
        self.params = params
        self.datagrams = Datagrams(self, udp_address(params.source))

    def scans(self) -> Iterator[Scan]:
        with self.datagrams:
            while not self.is_stopping:
                received = self.datagrams.next()
                scan = self._read(*received) if received is not None else None
                if scan is not None:
                    yield scan

    def _read(self, datagram: bytes, sender: Address) -> Scan | None:
        try:
            return replace(read_scan(datagram, self.monotonic_s()), frame_id=self.params.frame_id)
        except ValueError as error:
            self.datagrams.refuse(sender, error)
            return None


class LaserScanConfigurer(DataChannelConfigurer[UdpLaserScanParams]):
    """Laser scans that other programs on the robot send by UDP."""

    connector_type = "laser-scan"
    example: ClassVar[dict[str, Any] | None] = {"source": "udp://127.0.0.1:9011"}
    trial: ClassVar[dict[str, Any] | None] = {"source": "udp://127.0.0.1:0"}

    def configure(self) -> UdpLaserScan:
        return UdpLaserScan(self.label, self.params)
