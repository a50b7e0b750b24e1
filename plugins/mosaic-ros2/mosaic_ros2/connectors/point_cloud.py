"""The ``ros2-point-cloud`` connector: clouds of a topic, filtered and in MOSAIC's compact form."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, ClassVar

from pydantic import Field

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import Handler
from mosaic_core.contract.params import unit
from mosaic_ros2.bus.shared_bus import SharedBus
from mosaic_ros2.cdr.decoding import Decoder
from mosaic_ros2.connectors.listening import TopicListener
from mosaic_ros2.connectors.params import ReadsTopicParams
from mosaic_ros2.conversion.clouds import cloud_from
from mosaic_sensors.point_cloud import PointCloud, PointCloudParams, PointCloudSender

CLOUD = "sensor_msgs/msg/PointCloud2"


class Ros2PointCloudParams(ReadsTopicParams, PointCloudParams):
    """A topic of clouds, and what of them is sent."""


class RosPointCloud(PointCloudSender):
    """Sends a topic's clouds while somebody watches."""

    def __init__(self, label: str, params: Ros2PointCloudParams, shared: SharedBus) -> None:
        super().__init__(label, params)
        self.params = params
        self._shared = shared

    def clouds(self) -> Iterator[PointCloud]:
        listening = TopicListener(self, self._shared, self.params, CLOUD, newest_only=True)
        decoder = Decoder(self._shared.book, CLOUD)
        for arrived in listening.arrivals():
            if arrived is None:
                continue
            try:
                cloud = cloud_from(decoder.decode(arrived.data), listening.captured_at_s(arrived))
            except ValueError as error:
                listening.refuse(error)
                continue
            yield cloud


class Ros2PointCloudConfigurer(DataChannelConfigurer[Ros2PointCloudParams]):
    """Point clouds of a ROS 2 topic (PointCloud2)."""

    connector_type = "ros2-point-cloud"
    example: ClassVar[dict[str, Any] | None] = {"topic": "/points", "voxel_size_m": 0.05}

    def configure(self) -> Sequence[Handler]:
        return RosPointCloud(self.label, self.params, self.params.bus(self.shared)).handlers()


class OriginalPointCloudParams(PointCloudParams):
    """The params that original robots have."""

    topic_name: str = Field(min_length=1, description="The topic.")
    voxel_size: float | None = Field(
        default=None,
        description="Shaped original robots' octree; has no effect here.",
        json_schema_extra=unit("m"),
    )
    min_points_to_subdivide: int | None = Field(default=None, description="As `voxel_size`.")


class OriginalPointCloudConfigurer(DataChannelConfigurer[OriginalPointCloudParams]):
    """Point clouds of a ROS 2 topic, by the name that original robots have for it."""

    connector_type = "ros2-sender-sensor-PointCloud2"
    is_called_as_by_originals = True
    example: ClassVar[dict[str, Any] | None] = {"topic_name": "/points", "stream_mode": "progressive"}

    def configure(self) -> Sequence[Handler]:
        told = PointCloudParams.model_fields.keys() & self.params.model_fields_set
        cloud = {name: getattr(self.params, name) for name in told}
        params = Ros2PointCloudParams(topic=self.params.topic_name, **cloud)
        return RosPointCloud(self.label, params, params.bus(self.shared)).handlers()
