"""The ``mqtt-publish`` connector: commands of operators to a broker's topic."""

from __future__ import annotations

import logging
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, ClassVar, Protocol

from pydantic import Field

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.described_message import message_of
from mosaic_core.contract.handler import DataChannelReceivable, DataChannelSendable, Handler, Refused
from mosaic_core.contract.made_message import with_message
from mosaic_core.contract.params import Message
from mosaic_core.words.data_type import Delivery
from mosaic_mqtt.connection import WAIT_S
from mosaic_mqtt.params import FAKE, PublishParams
from mosaic_mqtt.payload import payload_of
from mosaic_mqtt.publication import BrokerPublication

_log = logging.getLogger(__name__)
SILENCE_S = 0.5
"""Without a command for so long, what moves is told to stand still."""


class OpenTopic(Protocol):
    """An open way to a topic."""

    def publish(self, payload: bytes) -> None: ...
    def make_safe(self) -> None: ...


class PublishLink:
    """Holds the open publication of one connector, if it is open: the body opens it, commands go through it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._publication: OpenTopic | None = None

    @contextmanager
    def carried_by(self, publication: OpenTopic) -> Iterator[None]:
        """Let commands through in this block, which ends with the safe payload. Body's thread."""
        with self._lock:
            self._publication = publication
        try:
            yield
        finally:
            with self._lock:
                self._publication = None  # first: no command comes after the last payload
                publication.make_safe()

    def publish(self, payload: bytes) -> None:
        """Receiver's thread. Raises :class:`Refused` (``plugin.no_device``) while the broker is away."""
        with self._lock:
            if self._publication is None:
                raise Refused("plugin.no_device", "the broker is away; the command is dropped")
            self._publication.publish(payload)

    def make_safe(self) -> None:
        """Safety thread. While the broker is away it has published the safe payload itself."""
        with self._lock:
            if self._publication is not None:
                self._publication.make_safe()


class BrokerState(Message):
    """Tells whether commands get through."""

    connected: bool = Field(description="Whether the broker takes commands.")


class MqttPublisherState(DataChannelSendable[BrokerState]):
    """Keeps the connection that carries the commands of :class:`MqttPublish`, and tells when there is one."""

    def __init__(self, label: str, params: PublishParams, link: PublishLink) -> None:
        super().__init__(label)
        self.params = params
        self._link = link

    def messages(self) -> Iterator[BrokerState]:
        """Raises :class:`~mosaic_core.words.errors.DeviceGone` when the broker is lost."""
        try:
            if self.params.broker == FAKE:
                yield from self._made_up()
            else:
                yield from self._connected()
        except BaseException:
            self.send_json(BrokerState(connected=False))
            raise

    def _connected(self) -> Iterator[BrokerState]:
        with self._publication() as publication:
            if self.is_stopping:
                return
            with self._link.carried_by(publication):
                yield BrokerState(connected=True)
                while not self.is_stopping:
                    publication.attend()

    def _publication(self) -> BrokerPublication:
        return BrokerPublication(self.params, self, safe_payload(self.params))

    def _made_up(self) -> Iterator[BrokerState]:
        with self._link.carried_by(_ShownPublication(self.params)):
            yield BrokerState(connected=True)
            while not self.pause(WAIT_S):
                pass


class _ShownPublication:
    """Shows in the log what it is given, for whoever has no broker."""

    def __init__(self, params: PublishParams) -> None:
        self._topic = params.topic
        self._safe = safe_payload(params)

    def publish(self, payload: bytes) -> None:
        _log.debug("%s: %r", self._topic, payload)

    def make_safe(self) -> None:
        if self._safe is not None:
            self.publish(self._safe)


def safe_payload(params: PublishParams) -> bytes | None:
    """What brings whoever listens into a safe state, as it is published."""
    return None if params.safe_command is None else payload_of(params.safe_command, params.payload)


class MqttPublish(DataChannelReceivable[Any]):
    """Publishes a command; silence, a lost operator and a stop publish the safe payload."""

    requires_lease = True

    def __init__(self, label: str, params: PublishParams, link: PublishLink) -> None:
        super().__init__(label)
        self.timeout_s = SILENCE_S if params.moves else None
        self._form = params.payload
        self._link = link

    def handle_data(self, data: Message) -> None:
        """Receiver's thread."""
        self._link.publish(payload_of(data.model_dump(mode="json"), self._form))

    def make_safe(self, cause: str) -> None:
        """Safety thread."""
        self._link.make_safe()


class MqttMove(MqttPublish):
    """The same of commands that move something: only the newest counts."""

    delivery: ClassVar[Delivery] = Delivery.LATEST


class MqttPublishConfigurer(DataChannelConfigurer[PublishParams]):
    """Commands of operators to a topic of an MQTT broker, with a safe payload for when nobody commands."""

    connector_type = "mqtt-publish"
    example: ClassVar[dict[str, Any] | None] = {
        "broker": "mqtt://127.0.0.1:1883",
        "topic": "rover/drive",
        "fields": {"speed_mps": {"kind": "velocity"}},
    }
    trial: ClassVar[dict[str, Any] | None] = {
        "broker": FAKE,
        "topic": "rover/drive",
        "fields": {"speed_mps": {"kind": "velocity"}, "lamp": {"type": "boolean"}},
        "safe": {"lamp": False},
    }

    def configure(self) -> Sequence[Handler]:
        params, link = self.params, PublishLink()
        kind = MqttMove if params.moves else MqttPublish
        receiver = with_message(kind, message_of("MqttCommand", params.fields), DataChannelReceivable)
        return [receiver(self.label, params, link), MqttPublisherState(f"{self.label}_broker", params, link)]
