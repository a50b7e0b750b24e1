"""Clouds that other programs send in datagrams."""

from __future__ import annotations

import ipaddress
import logging
import socket
from collections.abc import Iterator
from urllib.parse import urlsplit

from mosaic_sensors.point_cloud.cloud import PointCloud, cloud_of
from mosaic_sensors.point_cloud.datagrams import Assembly
from mosaic_sensors.point_cloud.params import PointCloudParams
from mosaic_sensors.point_cloud.sender import PointCloudSender

_log = logging.getLogger(__name__)

RECEIVE_TIMEOUT_S = 0.2
"""Longest wait for a datagram; a handler has 1.5 s to stop."""
_BUFFER_BYTES = 4 * 1024 * 1024
"""A cloud arrives in one burst; the system's default holds a fifth of a megabyte."""
_MAX_DATAGRAM_BYTES = 65_535


def udp_address(source: str) -> tuple[str, int]:
    """Address and port of ``udp://address:port``. Raises :class:`ValueError`."""
    parts = urlsplit(source)
    try:
        address = ipaddress.ip_address(parts.hostname or "")
        port = parts.port
    except ValueError:
        raise ValueError(f"{source!r} is no address to listen on; write udp://127.0.0.1:9010") from None
    if port is None or parts.path or parts.query:
        raise ValueError(f"{source!r} is no address to listen on; write udp://127.0.0.1:9010")
    return str(address), port


class UdpPointCloud(PointCloudSender):
    """One cloud per complete set of datagrams. What is none is counted in :attr:`malformed` and logged once."""

    def __init__(self, label: str, params: PointCloudParams, source: str, frame_id: str = "") -> None:
        super().__init__(label, params)
        self._source = source
        self._frame_id = frame_id
        self.malformed = 0
        self.address: tuple[str, int] | None = None
        """Where it listens, while it does."""

    def clouds(self) -> Iterator[PointCloud]:
        assembly = Assembly()
        with self._bound() as receiver:
            while not self.is_stopping:
                try:
                    datagram, sender = receiver.recvfrom(_MAX_DATAGRAM_BYTES)
                except TimeoutError:
                    continue
                try:
                    whole = assembly.feed(datagram, sender, self.monotonic_s())
                except ValueError as error:
                    self._refuse(sender, error)
                    continue
                if whole is not None:
                    yield cloud_of(whole.points, frame_id=self._frame_id, captured_at_s=whole.begun_at_s)

    def _bound(self) -> socket.socket:
        host, port = udp_address(self._source)
        receiver = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_DGRAM)
        try:
            receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER_BYTES)
            receiver.bind((host, port))
        except OSError as error:
            receiver.close()
            raise OSError(error.errno, f"can't listen on UDP {host} port {port}: {error.strerror}") from error
        receiver.settimeout(RECEIVE_TIMEOUT_S)
        self.address = receiver.getsockname()[:2]
        _log.info("%s: listens on UDP %s port %s", self.label, *self.address)
        if not ipaddress.ip_address(host).is_loopback:
            _log.warning("%s: anybody who reaches %s can feed this sensor", self.label, host)
        return receiver

    def _refuse(self, sender: tuple[object, ...], error: ValueError) -> None:
        self.malformed += 1
        if self.malformed == 1:
            _log.warning("%s: refused a datagram of %s:%s: %s", self.label, sender[0], sender[1], error)
