"""The ``ros2-image`` connector: pictures of a topic as video."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar, Literal

from pydantic import Field

from mosaic_core import Captured, EncodingParams, MediaTrackConfigurer, MediaTrackHandler
from mosaic_core.contract.params import unit
from mosaic_core.machines.timing.pacing import GridThinning
from mosaic_ros2.bus.shared_bus import SharedBus
from mosaic_ros2.cdr.decoding import Decoder
from mosaic_ros2.connectors.listening import TopicListener
from mosaic_ros2.connectors.params import ReadsTopicParams
from mosaic_ros2.conversion.pictures import READERS

ImageType = Literal["auto", "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"]


class Ros2ImageParams(ReadsTopicParams, EncodingParams):
    type: ImageType = Field(default="auto", description="auto: whichever of the two its publisher has.")
    fps: float | None = Field(
        default=None, gt=0, le=240, description="At most this many pictures per second.", json_schema_extra=unit("1/s")
    )
    depth_max_m: float = Field(
        default=10.0, gt=0, le=1000, description="Depth images: this distance is black.", json_schema_extra=unit("m")
    )


class RosImage(MediaTrackHandler):
    """Sends a topic's pictures while somebody watches."""

    def __init__(self, label: str, params: Ros2ImageParams, shared: SharedBus) -> None:
        super().__init__(label)
        self.params = params
        self.encoding = params
        self._shared = shared

    def frames(self) -> Iterator[Captured]:
        type_name = "" if self.params.type == "auto" else self.params.type
        listening = TopicListener(self, self._shared, self.params, type_name, newest_only=True)
        pace = GridThinning(self.params.fps) if self.params.fps is not None else None
        decoder: Decoder | None = None
        for arrived in listening.arrivals():
            if arrived is None:
                continue
            captured_at_s = listening.captured_at_s(arrived)
            if pace is not None and not pace.takes(captured_at_s):
                self.count_loss("thinned")
                continue
            try:
                read = READERS.get(listening.type_name)
                if read is None:
                    raise ValueError(f"{listening.type_name} is no image")
                decoder = decoder or Decoder(self._shared.book, listening.type_name)
                picture = read(decoder.decode(arrived.data), self.params.depth_max_m)
            except ValueError as error:
                listening.refuse(error)
                continue
            yield Captured(picture, captured_at_s)


class Ros2ImageConfigurer(MediaTrackConfigurer[Ros2ImageParams]):
    """Pictures of a ROS 2 topic (Image or CompressedImage) as video."""

    connector_type = "ros2-image"
    example: ClassVar[dict[str, Any] | None] = {"topic": "/camera/image_raw"}

    def configure(self) -> RosImage:
        return RosImage(self.label, self.params, self.params.bus(self.shared))


class OriginalImageParams(EncodingParams):
    """The params that original robots have."""

    topic_name: str = Field(min_length=1, description="The topic.")
    recordable: bool | None = Field(default=None, description="Has no effect, as on original robots.")


class OriginalImageConfigurer(MediaTrackConfigurer[OriginalImageParams]):
    """Pictures of a ROS 2 topic, by the name that original robots have for it."""

    connector_type = "ros2-sender-sensor-Image"
    is_called_as_by_originals = True
    example: ClassVar[dict[str, Any] | None] = {"topic_name": "/camera/image_raw"}

    def configure(self) -> RosImage:
        told = EncodingParams.model_fields.keys() & self.params.model_fields_set
        encoding = {name: getattr(self.params, name) for name in told}
        params = Ros2ImageParams(topic=self.params.topic_name, **encoding)
        return RosImage(self.label, params, params.bus(self.shared))
