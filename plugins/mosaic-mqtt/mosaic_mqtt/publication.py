"""Publishes to an MQTT broker: at once, or not at all. A command that waited would move a robot long after it was
given.
"""

from __future__ import annotations

import selectors
import ssl
import threading
from typing import Literal

from paho.mqtt.client import Client
from paho.mqtt.enums import MQTTErrorCode

from mosaic_core.words.errors import DeviceGone, Refused
from mosaic_mqtt.connection import BROKEN, WAIT_S, BrokerConnection, Waits
from mosaic_mqtt.params import PublishParams

MAX_UNACKNOWLEDGED = 16
"""Commands of QoS 1 under way; brokers take at least 20 at a time, and what is beyond would queue."""


class BrokerPublication(BrokerConnection):
    """Publishes under one topic while it is entered. The broker publishes ``safe`` in our name when we are lost.

    The body's thread enters, attends and leaves; any other one may publish meanwhile, and waits for nothing but a turn
    of the others.
    """

    def __init__(self, params: PublishParams, waits: Waits, safe: bytes | None = None) -> None:
        super().__init__(params, waits)
        self._topic = params.topic
        self._qos = params.qos
        self._retain = params.retain
        self._safe = safe
        self._turn = threading.Lock()
        """The library writes on whichever thread publishes: two at a time would mix their bytes."""

    def publish(self, payload: bytes) -> None:
        """Hand a command to the network. Raises :class:`Refused` (``plugin.no_device``): it is never sent then."""
        with self._turn:
            if self._client.want_write():
                raise Refused("plugin.no_device", "the broker takes nothing now; the command is dropped")
            code = self._sent(payload, self._qos)
        if code == MQTTErrorCode.MQTT_ERR_QUEUE_SIZE:
            raise Refused("plugin.no_device", "the broker acknowledges nothing; the command is dropped")
        if code != MQTTErrorCode.MQTT_ERR_SUCCESS:
            raise Refused("plugin.no_device", "the broker is lost; connecting again")

    def make_safe(self) -> None:
        """Publish the safe payload, whatever waits. A connection that is lost needs none: the broker does it then."""
        with self._turn:
            if self._safe is None:
                return
            if self._sent(self._safe, self._qos) == MQTTErrorCode.MQTT_ERR_QUEUE_SIZE:
                self._sent(self._safe, 0)

    def attend(self) -> None:
        """Take part in the connection for up to :data:`WAIT_S`. Raises :class:`DeviceGone` if it is lost."""
        own_socket = self._client.socket()
        if own_socket is not None and not _holds_bytes(own_socket):
            with selectors.DefaultSelector() as waiting:
                wants = selectors.EVENT_WRITE if self._client.want_write() else 0
                waiting.register(own_socket, selectors.EVENT_READ | wants)
                ready = [events for _, events in waiting.select(WAIT_S)]
        else:
            ready = [selectors.EVENT_READ]
        with self._turn:
            client = self._client
            if any(events & selectors.EVENT_READ for events in ready):
                self._do(client.loop_read)
            if client.want_write():
                self._do(client.loop_write)
            self._do(client.loop_misc)

    def _new_client(self) -> Client:
        client = super()._new_client()
        client.max_queued_messages_set(MAX_UNACKNOWLEDGED)
        if self._safe is not None:
            client.will_set(self._topic, self._safe, self._qos, self._retain)
        return client

    def _begin(self) -> None:
        """What was said before the connection was lost, by us or by another, may still be carried out."""
        if self._safe is not None and self._sent(self._safe, self._qos) != MQTTErrorCode.MQTT_ERR_SUCCESS:
            raise DeviceGone(f"{self._params.broker} is lost", "check the broker and the network")

    def _sent(self, payload: bytes, qos: Literal[0, 1]) -> MQTTErrorCode:
        try:
            return self._client.publish(self._topic, payload, qos, self._retain).rc
        except BROKEN:
            return MQTTErrorCode.MQTT_ERR_CONN_LOST

    def _close(self) -> None:
        with self._turn:
            super()._close()


def _holds_bytes(own_socket: object) -> bool:
    """Whether TLS has read from the network what nobody has asked it for: the network itself looks empty then."""
    return isinstance(own_socket, ssl.SSLSocket) and own_socket.pending() > 0
