"""The ``mqtt-subscribe`` connector: what a broker has for a topic filter, to operators."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, ClassVar, TypeVar

from pydantic import Field

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.devices.refused_input import RefusedInput
from mosaic_core.contract.handler import DataChannelSendable
from mosaic_core.contract.params import Message
from mosaic_core.words.wire_model import parsed_value
from mosaic_mqtt.fake_subscription import FakeSubscription
from mosaic_mqtt.params import FAKE, SubscribeParams
from mosaic_mqtt.subscription import BrokerMessage, BrokerSubscription

T = TypeVar("T")


class MqttMessage(Message):
    """Carries one JSON payload, and where it came from."""

    topic: str = Field(description="The topic under which it was published.")
    retained: bool = Field(description="Whether the broker had kept it from before.")
    value: Any = Field(description="The payload.")


class _MqttSubscriber(DataChannelSendable[T]):
    """Sends a message for each of the broker's. What can't be read counts as refused."""

    def __init__(self, label: str, params: SubscribeParams) -> None:
        super().__init__(label)
        self.params = params

    def _received(self, read: Callable[[BrokerMessage], T]) -> Iterator[T]:
        refusals = RefusedInput(self)
        with self._subscription() as subscription:
            while not self.is_stopping:
                received = subscription.next()
                if received is None:
                    continue
                try:
                    message = read(received)
                except ValueError as error:
                    refusals.add(f"a message of {received.topic!r}", error)
                else:
                    yield message

    def _subscription(self) -> BrokerSubscription | FakeSubscription:
        if self.params.broker == FAKE:
            return FakeSubscription(self.params.topic, self.pause)
        return BrokerSubscription(self.params, self.params.topic, self.params.qos, self)


class MqttJson(_MqttSubscriber[MqttMessage]):
    """Sends JSON payloads with their topics."""

    def messages(self) -> Iterator[MqttMessage]:
        return self._received(
            lambda one: MqttMessage(topic=one.topic, retained=one.is_retained, value=parsed_value(one.payload))
        )


class MqttText(_MqttSubscriber[str]):
    """Sends payloads that are text in UTF-8."""

    def messages(self) -> Iterator[str]:
        return self._received(lambda one: one.payload.decode())


class MqttBytes(_MqttSubscriber[bytes]):
    """Sends payloads as they are."""

    def messages(self) -> Iterator[bytes]:
        return self._received(lambda one: one.payload)


class MqttSubscribeConfigurer(DataChannelConfigurer[SubscribeParams]):
    """Messages of an MQTT broker, by topic: JSON, text or bytes."""

    connector_type = "mqtt-subscribe"
    example: ClassVar[dict[str, Any] | None] = {"broker": "mqtt://127.0.0.1:1883", "topic": "greenhouse/+/climate"}
    trial: ClassVar[dict[str, Any] | None] = {"broker": FAKE, "topic": "greenhouse/+/climate"}

    def configure(self) -> MqttJson | MqttText | MqttBytes:
        kinds: dict[str, type[MqttJson | MqttText | MqttBytes]] = {
            "json": MqttJson, "text": MqttText, "bytes": MqttBytes
        }  # fmt: skip
        return kinds[self.params.format](self.label, self.params)
