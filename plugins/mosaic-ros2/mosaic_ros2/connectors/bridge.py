"""The ``ros2-bridge`` connector: what other connectors of this robot send goes to topics of ROS, too.

It tells operators how each of them is: who subscribes, how many messages were published, and which could not be.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from typing import Any, ClassVar

from pydantic import Field, GetJsonSchemaHandler, field_validator, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from mosaic_core import DataLabel, DeviceGone
from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.data_tap import DataTap
from mosaic_core.contract.handler import DataChannelSendable
from mosaic_core.contract.params import Params
from mosaic_core.messages import Diagnostic
from mosaic_core.words.errors import hint_at
from mosaic_ros2.bus.bus import Bus
from mosaic_ros2.bus.qos import QosChoice
from mosaic_ros2.bus.shared_bus import SharedBus
from mosaic_ros2.connectors.bridged_channel import BridgedChannel
from mosaic_ros2.connectors.bridged_types import STANDARD_TYPES, type_of
from mosaic_ros2.connectors.params import Ros2Params, RosName, TypeName

WAKE_S = 0.2
"""How long one waits before one looks whether the handler shall stop."""
REPORT_S = 1.0
MAX_TOPICS = 256


class BridgedTopic(Params):
    """A topic, and how messages go there; its name alone is the short form of it."""

    topic: RosName = Field(description="Its name, like /scan.")
    type: TypeName | None = Field(
        default=None,
        description="Its type, where a message can be several: tf2_msgs/msg/TFMessage on /tf; default: the usual one.",
    )
    qos: QosChoice = Field(
        default="auto",
        description="auto: reliable, and of maps and ways the last one for whoever comes later; sensor: best effort; "
        "reliable; latched.",
    )
    frame_id: str = Field(
        default="", max_length=128, description="Frame of messages that name none; default: the one that they mean."
    )

    @model_validator(mode="before")
    @classmethod
    def _short_form(cls, data: object) -> object:
        return {"topic": data} if isinstance(data, str) else data

    @field_validator("type")
    @classmethod
    def _is_a_standard_message(cls, name: str | None) -> str | None:
        if name is not None and name not in STANDARD_TYPES:
            raise ValueError(f"no standard message becomes a {name}{hint_at(name, STANDARD_TYPES)}")
        return name

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Editors shall complete either form."""
        long_form: dict[str, Any] = handler.resolve_ref_schema(handler(schema))
        return {"anyOf": [{"type": "string"}, long_form], "description": long_form.get("description", "")}


class Ros2BridgeParams(Ros2Params):
    topics: dict[DataLabel, BridgedTopic] = Field(
        min_length=1,
        max_length=MAX_TOPICS,
        description="Label of a connector of this robot that sends a standard message, and the topic where it goes: a "
        "name like /scan, or `topic` with `type`, `qos` and `frame_id`.",
    )


class RosBridge(DataChannelSendable[Diagnostic]):
    """Publishes what other connectors send, whether operators listen or not."""

    def __init__(self, label: str, params: Ros2BridgeParams, shared: SharedBus) -> None:
        super().__init__(label)
        self._topics = params.topics
        self._shared = shared

    def messages(self) -> Iterator[Diagnostic]:
        with self.tap_data(*self._topics) as tap, ExitStack() as opened:
            bus, channels = self._shared.joined(), {}
            for one in tap.channels:
                told = self._topics[DataLabel(one.label)]
                kind = type_of(one, told.type)
                channel = BridgedChannel(one.label, told.topic, kind, told.qos, told.frame_id, self._shared.book)
                opened.callback(channel.close)
                channel.open(bus)
                channels[one.label] = channel
            yield from self._bridged(tap, bus, channels)

    def _bridged(self, tap: DataTap, bus: Bus, channels: Mapping[str, BridgedChannel]) -> Iterator[Diagnostic]:
        report_at_s, dropped = self.monotonic_s(), 0
        while not self.is_stopping:
            message = tap.next(WAKE_S)
            if message is not None and message.sender is None and not channels[message.label].take(message, bus):
                self.count_loss("refused")
            if tap.dropped > dropped:
                self.count_loss("dropped", tap.dropped - dropped)
                dropped = tap.dropped
            if message is None and tap.failure:
                raise DeviceGone(f"nothing comes of {', '.join(self._topics)} any more ({tap.failure})")
            if self.monotonic_s() >= report_at_s:
                report_at_s = self.monotonic_s() + REPORT_S
                yield from (one.report() for one in channels.values())


class Ros2BridgeConfigurer(DataChannelConfigurer[Ros2BridgeParams]):
    """What other connectors of this robot send, as ROS 2 topics: a lidar becomes a LaserScan."""

    connector_type = "ros2-bridge"
    example: ClassVar[dict[str, Any] | None] = {"topics": {"scan": "/scan"}}

    def configure(self) -> RosBridge:
        return RosBridge(self.label, self.params, self.params.bus(self.shared))
