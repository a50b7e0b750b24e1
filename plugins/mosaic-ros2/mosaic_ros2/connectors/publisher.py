"""The ``ros2-publisher`` connector: operators' messages to a topic, within the robot's limits.

A Twist, a JointTrajectory, another standard message, or any other type as JSON. Silence, a lost operator and a stop
publish what makes the robot safe: a standstill, the joints where they are, or ``safe_message``.
"""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import Field, JsonValue

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.words.errors import ConfigError, Problem
from mosaic_core.words.safety_config import FieldPath
from mosaic_ros2.bus.kept_publication import KeptPublication
from mosaic_ros2.bus.qos import PROFILES, QosChoice, QosProfile
from mosaic_ros2.cdr.encoding import CdrEncoder
from mosaic_ros2.connectors.joint_watch import JointWatch
from mosaic_ros2.connectors.params import Ros2Params, RosName, TypeName
from mosaic_ros2.connectors.publishing import (
    JsonPublisher,
    RosPublisher,
    TwistPublisher,
    json_publisher,
    standard_publisher,
)
from mosaic_ros2.connectors.safety import OriginalTwistSafety, PublisherSafety
from mosaic_ros2.connectors.trajectory import TRAJECTORY, trajectory_publisher
from mosaic_ros2.conversion.conversions import CONVERSIONS
from mosaic_ros2.conversion.json_form import model_of

TWIST, TWIST_STAMPED = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"


class Ros2PublisherParams(Ros2Params):
    topic: RosName = Field(description="Its name, like /cmd_vel.")
    type: TypeName = Field(description="Its type, like geometry_msgs/msg/Twist.")
    qos: QosChoice = Field(default="auto", description="auto and reliable: reliable; sensor: best effort; latched.")
    frame_id: str = Field(default="", max_length=128, description="Frame in the header, where the message names none.")
    joints: tuple[FieldPath, ...] = Field(
        default=(), max_length=64, description="JointTrajectory: commands name each of these, and limits hold for each."
    )
    joint_states: RosName = Field(
        default="/joint_states", description="JointTrajectory: the topic that tells where the joints are."
    )
    reach_s: float = Field(
        default=1.0, gt=0, le=60, description="JointTrajectory: time for a way where the command says none."
    )
    motion_fields: tuple[FieldPath, ...] = Field(
        default=(),
        max_length=32,
        description="Other types: dotted paths of numbers that mean motion and are 0 at a standstill.",
    )
    safe_message: dict[str, JsonValue] | None = Field(
        default=None, description="Other types: what is published on silence, a lost operator or a stop."
    )

    def profile(self) -> QosProfile:
        """What the publication offers. Of commands the newest counts."""
        chosen = PROFILES["reliable" if self.qos == "auto" else self.qos]
        return QosProfile(chosen.is_reliable, chosen.is_latched, depth=1)


def mistake(message: str, cure: str) -> ConfigError:
    """A connector that can't be what its file says."""
    return ConfigError([Problem(message, cure=cure)])


class Ros2PublisherConfigurer(DataChannelConfigurer[Ros2PublisherParams]):
    """Operators' messages to a ROS 2 topic: standard messages, velocities with limits, or any type as JSON."""

    connector_type = "ros2-publisher"
    safety_model = PublisherSafety
    example: ClassVar[dict[str, Any] | None] = {"topic": "/lamp", "type": "std_msgs/msg/Bool"}

    def configure(self) -> RosPublisher[Any]:
        params, safety = self.params, PublisherSafety.model_validate(self.safety.model_dump())
        shared = params.bus(self.shared)
        encoder = CdrEncoder(shared.book, params.type)
        key = f"mosaic-ros2:publish:{self.label}"
        publication = self.shared.get(key, lambda: KeptPublication(shared, params.topic, params.type, params.profile()))
        if params.type in (TWIST, TWIST_STAMPED):
            return self._twist(publication, encoder, safety)
        if safety.field_limits():
            raise mistake("max_linear_mps and max_angular_radps are for a Twist", "write `limits:` by field")
        if params.type == TRAJECTORY:
            watch = self.shared.get(f"{key}:joints", lambda: JointWatch(shared, params.joint_states))
            return trajectory_publisher(params.joints)(self.label, publication, encoder, watch, params.reach_s)
        handler = self._standard() or json_publisher(
            model_of(shared.book, params.type, is_command=True), params.motion_fields
        )
        safe = {} if params.motion_fields and params.safe_message is None else params.safe_message
        if safe is not None:
            encoder.encode(safe)  # a mistake in it is told before the robot starts
        elif safety.timeout_s is not None:
            raise mistake("after timeout_s nothing could be published", "write `safe_message`, {} for all zeros")
        return handler(self.label, publication, encoder, safe)

    def _standard(self) -> type[JsonPublisher[Any]] | None:
        """The class of a type that is a standard message; ``None``: it is none."""
        kind = CONVERSIONS.get(self.params.type)
        if kind is None or kind.fields is None:
            return None
        if self.params.motion_fields:
            raise mistake(f"a {kind.message.__name__} says itself what moves", "leave `motion_fields` out")
        return standard_publisher(kind, kind.fields, self.params.frame_id)

    def _twist(self, publication: KeptPublication, encoder: CdrEncoder, safety: PublisherSafety) -> TwistPublisher:
        if not safety.names_speeds():
            cure = "write `safety: { max_linear_mps: 0.5, max_angular_radps: 1.0 }`, with your robot's numbers"
            raise mistake(f"nothing limits the velocities on {self.params.topic}", cure)
        if "hold" in (safety.on_timeout, safety.on_loss):
            raise mistake("a base that holds its velocity drives on for ever", "use callback (it stops) or zero")
        frame_id = self.params.frame_id if self.params.type == TWIST_STAMPED else None
        return TwistPublisher(self.label, publication, encoder, frame_id)


class OriginalTwistParams(Ros2Params):
    """The params that original robots have."""

    topic_name: str = Field(min_length=1, description="The topic.")
    frame_id: str = Field(default="", max_length=128, description="Frame in the header of a TwistStamped.")


class _OriginalTwist(DataChannelConfigurer[OriginalTwistParams]):
    safety_model = OriginalTwistSafety
    type_name: ClassVar[str] = TWIST
    example: ClassVar[dict[str, Any] | None] = {"topic_name": "/cmd_vel"}

    def configure(self) -> RosPublisher[Any]:
        own = self.params.model_dump(exclude={"topic_name"})
        params = Ros2PublisherParams(topic=self.params.topic_name, type=self.type_name, **own)
        return Ros2PublisherConfigurer(self.label, params, safety=self.safety, shared=self.shared).configure()


class OriginalTwistConfigurer(_OriginalTwist):
    """Velocities to a ROS 2 topic (Twist), by the name that original robots have for it."""

    connector_type = "ros2-receiver-geometry-Twist"
    is_called_as_by_originals = True


class OriginalTwistStampedConfigurer(_OriginalTwist):
    """Velocities to a ROS 2 topic (TwistStamped), by the name that original robots have for it."""

    connector_type = "ros2-receiver-geometry-TwistStamped"
    is_called_as_by_originals = True
    type_name = TWIST_STAMPED
