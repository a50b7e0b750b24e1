"""The ``ros2-topic`` connector: any topic to operators, as a standard message where there is one, else as JSON with the
names that ROS has.
"""

from __future__ import annotations

import types
from collections.abc import Iterable, Iterator
from typing import Any, ClassVar, Generic, TypeVar

from pydantic import Field, model_validator

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import DataChannelSendable
from mosaic_core.contract.params import Message
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.delivery import DeliveryContract
from mosaic_core.words.errors import ConfigError, Problem
from mosaic_ros2.bus.bus import Arrived
from mosaic_ros2.bus.shared_bus import SharedBus
from mosaic_ros2.cdr.cursor import CdrError
from mosaic_ros2.cdr.decoding import Decoder
from mosaic_ros2.connectors.listening import TopicListener
from mosaic_ros2.connectors.params import ReadsTopicParams, TypeName
from mosaic_ros2.connectors.thinning import KeyedThinning
from mosaic_ros2.conversion.conversions import CONVERSIONS, Conversion
from mosaic_ros2.conversion.json_form import model_of, plain
from mosaic_ros2.definitions.definition import DefinitionError

T = TypeVar("T")

_OTHER_CONNECTORS = {
    "sensor_msgs/msg/Image": "ros2-image",
    "sensor_msgs/msg/CompressedImage": "ros2-image",
    "sensor_msgs/msg/PointCloud2": "ros2-point-cloud",
}


class Ros2TopicParams(ReadsTopicParams):
    type: TypeName | None = Field(
        default=None,
        description="Its type, like sensor_msgs/msg/LaserScan; without it whatever is heard, as JSON without a schema.",
    )
    max_rate_hz: float = Field(
        default=20.0, gt=0, le=1000, description="Messages beyond this rate are left out; of events none is."
    )
    max_bytes: int = Field(
        default=4_000_000, ge=64, le=64_000_000, description="Larger messages are refused before they are decoded."
    )

    @model_validator(mode="after")
    def _is_no_picture(self) -> Ros2TopicParams:
        other = _OTHER_CONNECTORS.get(self.type or "")
        if other is not None:
            raise ValueError(f"{self.type} as JSON would be huge: use the connector {other}")
        return self


class RosTopic(DataChannelSendable[T], Generic[T]):
    """Sends the messages of one topic while somebody listens."""

    runs = "watched"
    delivery: ClassVar[Delivery | DeliveryContract] = Delivery.LATEST
    conversion: ClassVar[Conversion | None] = None

    def __init__(self, label: str, params: Ros2TopicParams, shared: SharedBus) -> None:
        super().__init__(label)
        self.params = params
        self._shared = shared
        self._thinning: KeyedThinning[Any] = KeyedThinning(params.max_rate_hz)

    def messages(self) -> Iterator[Any]:
        listening = TopicListener(self, self._shared, self.params, self.params.type or "")
        decoder: Decoder | None = None
        for arrived in listening.arrivals():
            decoder = decoder or Decoder(self._shared.book, listening.type_name)
            yield from self._thinned(arrived, decoder, listening)

    def _thinned(self, arrived: Arrived | None, decoder: Decoder, listening: TopicListener) -> Iterator[Any]:
        """One topic is thinned before it is decoded; frames and parts of one topic after that."""
        now_s, conversion = self.monotonic_s(), self.conversion
        is_keyed = conversion is not None and conversion.key is not None
        ready: list[Any] = list(self._thinning.due(now_s))
        if arrived is not None and conversion is not None and conversion.is_event:
            ready.append(arrived)
        elif arrived is not None and is_keyed:
            for message in self._converted(arrived, decoder, listening):
                ready.append(self._thinning.offer(conversion.key(message), message, now_s))  # type: ignore[union-attr, misc]
        elif arrived is not None:
            ready.append(self._thinning.offer(None, arrived, now_s))
        thinned = self._thinning.take_thinned()
        if thinned:
            self.count_loss("thinned", thinned)
        for one in ready:
            if isinstance(one, Arrived):
                yield from self._converted(one, decoder, listening)
            elif one is not None:
                yield one

    def _converted(self, arrived: Arrived, decoder: Decoder, listening: TopicListener) -> Iterable[Any]:
        try:
            if len(arrived.data) > self.params.max_bytes:
                raise CdrError(f"{len(arrived.data)} bytes are more than max_bytes ({self.params.max_bytes})")
            message = decoder.decode(arrived.data)
            return [plain(message)] if self.conversion is None else list(self.conversion.convert(message))
        except ValueError as error:  # of CDR, of pydantic, and what no number can be
            listening.refuse(error)
            return ()


def topic_class(message: type[Message] | None, conversion: Conversion | None) -> type[RosTopic[Any]]:
    """A handler class of this message: the catalogue reads its schema and its delivery from the class."""
    delivery = conversion.delivery if conversion is not None else Delivery.LATEST
    content = {"conversion": conversion, "delivery": delivery, "__module__": __name__}
    base: Any = RosTopic[message] if message is not None else RosTopic[dict[str, Any]]  # type: ignore[valid-type]
    made: type[RosTopic[Any]] = types.new_class("RosTopicOfType", (base,), {}, lambda own: own.update(content))
    return made


class Ros2TopicConfigurer(DataChannelConfigurer[Ros2TopicParams]):
    """Any ROS 2 topic to operators: standard messages with their widgets, others as JSON."""

    connector_type = "ros2-topic"
    example: ClassVar[dict[str, Any] | None] = {"topic": "/scan", "type": "sensor_msgs/msg/LaserScan"}

    def configure(self) -> RosTopic[Any]:
        shared = self.params.bus(self.shared)
        conversion = CONVERSIONS.get(self.params.type or "")
        message: type[Message] | None = conversion.message if conversion is not None else None
        if conversion is None and self.params.type is not None:
            try:
                message = model_of(shared.book, self.params.type, is_command=False)
            except DefinitionError as unknown:
                if shared.book.is_slip(self.params.type):
                    raise ConfigError([Problem(str(unknown))]) from unknown
                # Else its publisher may tell it; or the connector says that nobody does.
        return topic_class(message, conversion)(self.label, self.params, shared)
