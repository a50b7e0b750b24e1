"""Clouds that other programs send in datagrams."""

from __future__ import annotations

import logging
from collections.abc import Iterator

from mosaic_sensors.point_cloud.cloud import PointCloud, cloud_of
from mosaic_sensors.point_cloud.datagrams import Assembly
from mosaic_sensors.point_cloud.params import PointCloudParams
from mosaic_sensors.point_cloud.sender import PointCloudSender
from mosaic_sensors.udp_socket import MAX_DATAGRAM_BYTES, bound_socket

_log = logging.getLogger(__name__)


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
        with bound_socket(self._source, self.label) as receiver:
            self.address = receiver.getsockname()[:2]
            while not self.is_stopping:
                try:
                    datagram, sender = receiver.recvfrom(MAX_DATAGRAM_BYTES)
                except TimeoutError:
                    continue
                try:
                    whole = assembly.feed(datagram, sender, self.monotonic_s())
                except ValueError as error:
                    self._refuse(sender, error)
                    continue
                if whole is not None:
                    yield cloud_of(whole.points, frame_id=self._frame_id, captured_at_s=whole.begun_at_s)

    def _refuse(self, sender: tuple[object, ...], error: ValueError) -> None:
        self.malformed += 1
        if self.malformed == 1:
            _log.warning("%s: refused a datagram of %s:%s: %s", self.label, sender[0], sender[1], error)
