"""Connects to an MQTT broker, on the thread of whoever uses it: nothing is read or sent behind its back."""

from __future__ import annotations

import os
import selectors
import socket
import ssl
import struct
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Protocol, Self

from paho.mqtt.client import Client
from paho.mqtt.enums import CallbackAPIVersion, MQTTErrorCode, MQTTProtocolVersion
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties

from mosaic_core.words.errors import DeviceGone
from mosaic_mqtt.params import BrokerParams

WAIT_S = 0.2
"""Longest wait for the broker at a time; a handler has 1.5 s to stop."""
CONNECT_TIMEOUT_S = 1.0
"""For the TCP connection, which a stop does not interrupt."""
ANSWER_TIMEOUT_S = 5.0
"""For the broker's answers to the connection and to the subscription."""
GOODBYE_S = 0.5
"""For the broker to read what was sent last; a handler has 1.5 s to stop."""
GOODBYE_BYTES = 1 << 20
"""Most that a broker may say before it hangs up, too."""
BROKEN = (OSError, ValueError, IndexError, KeyError, TypeError, struct.error)
"""What the library raises of a lost socket, and of bytes that are no MQTT."""


class Waits(Protocol):
    """The handler's time and its wish to stop."""

    @property
    def is_stopping(self) -> bool: ...
    def monotonic_s(self) -> float: ...


class _EncryptedSocket(ssl.SSLSocket):
    """Closes itself if no trust is found: the library forgets it then, and each new try would leave one open."""

    def do_handshake(self, block: bool = False) -> None:
        try:
            super().do_handshake(block)
        except OSError:
            self.close()
            raise


class BrokerConnection:
    """Is connected to a broker while it is entered; what it is for, subclasses say. Not thread-safe."""

    def __init__(self, params: BrokerParams, waits: Waits) -> None:
        self._params = params
        self._waits = waits
        self._answers: list[Any] = []

    def __enter__(self) -> Self:
        """Raises :class:`DeviceGone` with the cure. Returns early, without a connection, if the handler shall stop."""
        self._answers.clear()
        self._client = client = self._new_client()
        try:
            self._do(lambda: client.connect(self._params.host, self._params.port, self._params.keepalive_s,
                                            properties=self._bounds()))  # fmt: skip
            self._await_answer("connection", "check username, password and the broker's rules")
            if not self._waits.is_stopping:
                self._begin()
        except BaseException:
            self._close()
            raise
        return self

    def _begin(self) -> None:
        """What is done first, once the broker has let us in."""
        raise NotImplementedError

    def __exit__(self, *_: object) -> None:
        self._close()

    def _new_client(self) -> Client:
        client = Client(CallbackAPIVersion.VERSION2, protocol=MQTTProtocolVersion.MQTTv5, reconnect_on_failure=False)
        client.connect_timeout = CONNECT_TIMEOUT_S
        if self._params.username is not None:
            password = self._params.password
            client.username_pw_set(self._params.username, password.get_secret_value() if password else None)
        if self._params.is_encrypted:
            client.tls_set_context(self._trust())
        client.on_connect = lambda client, data, flags, reason, properties: self._answers.append(reason)
        return client

    def _trust(self) -> ssl.SSLContext:
        try:
            trust = ssl.create_default_context(cafile=self._params.ca_file)
        except OSError as error:
            raise DeviceGone(f"the certificates in {self._params.ca_file} can't be read: {error}") from error
        trust.sslsocket_class = _EncryptedSocket
        return trust

    def _bounds(self) -> Properties:
        properties = Properties(PacketTypes.CONNECT)  # type: ignore[no-untyped-call]  # its author wrote no types
        properties.MaximumPacketSize = self._params.max_bytes
        return properties

    def _await_answer(self, what: str, cure: str) -> None:
        until_s = self._waits.monotonic_s() + ANSWER_TIMEOUT_S
        while not self._answers:
            if self._waits.is_stopping:
                return
            if self._waits.monotonic_s() > until_s:
                raise DeviceGone(f"{self._params.broker} does not answer", "is it an MQTT broker?")
            self._do(lambda: self._client.loop(WAIT_S))
        reason = self._answers.pop()
        if reason.is_failure:
            raise DeviceGone(f"{self._params.broker} refused the {what}: {reason}", cure)

    def _do(self, act: Callable[[], MQTTErrorCode]) -> None:
        """Raises :class:`DeviceGone` for whatever ends the connection, but not if the broker said why before."""
        try:
            code = act()
        except BROKEN as error:
            cure = "check its address, whether it runs, and for mqtts:// its certificate"
            raise DeviceGone(f"{self._params.broker} can't be used: {error}", cure) from error
        if code != MQTTErrorCode.MQTT_ERR_SUCCESS and not self._answers:
            raise DeviceGone(f"{self._params.broker} is lost: {code.name}", "check the broker and the network")

    def _close(self) -> None:
        """Says goodbye if it still can; whatever happens, nothing stays open, nor waits for the garbage collector."""
        client = self._client
        del self._client
        client.on_message = client.on_connect = client.on_subscribe = None
        own_socket = client.socket()
        if own_socket is None:
            return
        with suppress(*BROKEN), socket.socket(fileno=os.dup(own_socket.fileno())) as line:
            _say_goodbye(client, line)
        own_socket.close()


def _say_goodbye(client: Client, line: socket.socket) -> None:
    """Wait for the broker to read everything and to hang up on ``line``, another handle of the connection, which the
    library closes behind its last word. What is closed over answers that nobody has read is reset by the system, and a
    reset takes along whatever the other side hadn't read yet.
    """
    until_s = time.monotonic() + GOODBYE_S
    client.disconnect()
    with selectors.DefaultSelector() as waiting:
        waiting.register(line, selectors.EVENT_WRITE)
        while client.want_write() and (left_s := until_s - time.monotonic()) > 0:
            waiting.select(left_s)
            client.loop_write()
    line.shutdown(socket.SHUT_WR)
    unread = GOODBYE_BYTES
    while unread > 0 and (left_s := until_s - time.monotonic()) > 0:
        line.settimeout(left_s)
        heard = line.recv(min(unread, 65_536))
        if not heard:
            return
        unread -= len(heard)
