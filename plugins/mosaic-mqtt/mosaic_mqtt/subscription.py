"""Receives a broker's messages: nothing is read before it is asked for, so that a flood waits in the broker and in TCP,
where it is bounded, and not in the robot's memory.
"""

from __future__ import annotations

from collections import deque
from typing import Any, NamedTuple

from paho.mqtt.client import Client, MQTTMessage
from paho.mqtt.subscribeoptions import SubscribeOptions

from mosaic_mqtt.connection import WAIT_S, BrokerConnection, Waits
from mosaic_mqtt.params import BrokerParams


class BrokerMessage(NamedTuple):
    """One message of the broker; ``is_retained``: it was kept there from before."""

    topic: str
    payload: bytes
    is_retained: bool


class BrokerSubscription(BrokerConnection):
    """Receives what the broker has for one topic filter while it is entered. Not thread-safe."""

    def __init__(self, params: BrokerParams, topic: str, qos: int, waits: Waits) -> None:
        super().__init__(params, waits)
        self._topic = topic
        self._qos = qos
        self._inbox: deque[BrokerMessage] = deque()

    def next(self) -> BrokerMessage | None:
        """The next message; ``None`` after :data:`WAIT_S` of silence. Raises :class:`DeviceGone` if the broker is."""
        if not self._inbox:
            self._do(lambda: self._client.loop(WAIT_S))
        return self._inbox.popleft() if self._inbox else None

    def _new_client(self) -> Client:
        self._inbox.clear()
        client = super()._new_client()
        client.on_message = self._on_message
        client.on_subscribe = lambda client, data, packet_id, reasons, properties: self._answers.extend(reasons)
        return client

    def _begin(self) -> None:
        options = SubscribeOptions(qos=self._qos)
        self._do(lambda: self._client.subscribe(self._topic, options=options)[0])
        self._await_answer(f"subscription of {self._topic!r}", "check the broker's rules for this user")

    def _on_message(self, client: Client, data: Any, message: MQTTMessage) -> None:
        self._inbox.append(BrokerMessage(message.topic, bytes(message.payload), bool(message.retain)))
