"""Clouds that other programs send in datagrams."""

from __future__ import annotations

from collections.abc import Iterator

from mosaic_sensors.point_cloud.cloud import PointCloud, cloud_of
from mosaic_sensors.point_cloud.datagrams import Assembled, Assembly
from mosaic_sensors.point_cloud.params import PointCloudParams
from mosaic_sensors.point_cloud.sender import PointCloudSender
from mosaic_sensors.udp_socket import Datagrams, udp_address


class UdpPointCloud(PointCloudSender):
    """Sends a point cloud per complete set of datagrams. An incomplete one counts as lost, a datagram that is none as
    refused."""

    def __init__(self, label: str, params: PointCloudParams, source: str, frame_id: str = "") -> None:
        super().__init__(label, params)
        self.datagrams = Datagrams(self, udp_address(source))
        self._frame_id = frame_id

    def clouds(self) -> Iterator[PointCloud]:
        assembly = Assembly()
        with self.datagrams:
            while not self.is_stopping:
                whole = self._assembled(assembly)
                lost = assembly.take_incomplete()
                if lost:
                    self.count_loss("lost", lost)
                if whole is not None:
                    yield cloud_of(whole.points, frame_id=self._frame_id, captured_at_s=whole.begun_at_s)

    def _assembled(self, assembly: Assembly) -> Assembled | None:
        received = self.datagrams.next()
        if received is None:
            assembly.expire(self.monotonic_s())
            return None
        datagram, sender = received
        try:
            return assembly.feed(datagram, sender, self.monotonic_s())
        except ValueError as error:
            self.datagrams.refuse(sender, error)
            return None
