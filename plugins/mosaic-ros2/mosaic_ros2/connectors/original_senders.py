"""The senders of original robots by their names: poses and GPS fixes, with the keys that original dashboards read."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, ClassVar, TypeVar

from pydantic import Field

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.messages import GpsFix, Pose, wall_time_us
from mosaic_ros2.connectors.params import Ros2Params
from mosaic_ros2.connectors.topic import Ros2TopicParams, RosTopic, topic_class
from mosaic_ros2.conversion.conversions import Conversion
from mosaic_ros2.conversion.parts import Ros, headed, pose
from mosaic_ros2.conversion.sensing import fix

T = TypeVar("T", Pose, GpsFix)


class OriginalSenderParams(Ros2Params):
    """The params that original robots have."""

    topic_name: str = Field(min_length=1, description="The topic.")


class NestedPose(Pose):
    """A pose, and once more under ``pose``, where the original map widget looks for it."""

    pose: Pose


def _timed(made: T) -> T:
    """Original dashboards want a time: that of its arrival, where the message has none."""
    return made if made.timestamp is not None else made.model_copy(update={"timestamp": wall_time_us()})


def _timed_pose(message: Ros) -> Iterable[Pose]:
    yield _timed(pose(message))


def _timed_fix(message: Ros) -> Iterable[GpsFix]:
    yield from map(_timed, fix(message))


def _nested_pose(message: Ros) -> Iterable[NestedPose]:
    own = _timed(pose(message["pose"]["pose"], **headed(message)))
    yield NestedPose(**{name: getattr(own, name) for name in Pose.model_fields}, pose=own)


class _OriginalSender(DataChannelConfigurer[OriginalSenderParams]):
    type_name: ClassVar[str]
    conversion: ClassVar[Conversion]

    def configure(self) -> RosTopic[Any]:
        own = self.params.model_dump(exclude={"topic_name"})
        params = Ros2TopicParams(topic=self.params.topic_name, type=self.type_name, **own)
        return topic_class(self.conversion.message, self.conversion)(self.label, params, params.bus(self.shared))


class OriginalPoseConfigurer(_OriginalSender):
    """Poses of a ROS 2 topic (Pose), by the name that original robots have for it."""

    connector_type = "ros2-sender-geometry-Pose"
    is_called_as_by_originals = True
    example: ClassVar[dict[str, Any] | None] = {"topic_name": "/pose"}
    type_name = "geometry_msgs/msg/Pose"
    conversion = Conversion(Pose, _timed_pose)


class OriginalCovariancePoseConfigurer(_OriginalSender):
    """Poses of a ROS 2 topic (PoseWithCovarianceStamped), by the name that MOSAIC's documentation has for it."""

    connector_type = "ros2-sender-geometry-PoseWithCovarianceStamped"
    is_called_as_by_originals = True
    example: ClassVar[dict[str, Any] | None] = {"topic_name": "/amcl_pose"}
    type_name = "geometry_msgs/msg/PoseWithCovarianceStamped"
    conversion = Conversion(NestedPose, _nested_pose)


class OriginalFixConfigurer(_OriginalSender):
    """GPS fixes of a ROS 2 topic (NavSatFix), by the name that original robots have for it."""

    connector_type = "ros2-sender-sensor-NavSatFix"
    is_called_as_by_originals = True
    example: ClassVar[dict[str, Any] | None] = {"topic_name": "/fix"}
    type_name = "sensor_msgs/msg/NavSatFix"
    conversion = Conversion(GpsFix, _timed_fix)
