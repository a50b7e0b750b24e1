"""Commands reach a broker's topic at once or not at all, and what makes safe is said whenever nobody commands."""

from __future__ import annotations

import collections
import json
import select
import socket
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager, suppress
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from paho.mqtt.client import Client, MQTTMessage
from paho.mqtt.enums import CallbackAPIVersion, MQTTProtocolVersion
from support.devices.absence import thirty_seconds

from mosaic_core.testing import Leaves, Silence, Stopped, build, collect, fake_host, feed
from mosaic_core.words.data_type import Delivery
from mosaic_core.words.errors import ConfigError, DeviceGone, Refused
from mosaic_core.words.wire_model import parsed_value
from mosaic_mqtt.payload import payload_of
from mosaic_mqtt.publish import MqttPublish, MqttPublishConfigurer, MqttPublisherState

if TYPE_CHECKING:
    from conftest import Mosquitto

TOPIC = "rover/drive"
DRIVE = {"speed_mps": {"kind": "velocity"}, "lamp": {"type": "boolean"}}
GO = {"speed_mps": 0.25, "lamp": True}
SAFE = {"speed_mps": 0.0, "lamp": False}
ROVER = {"username": "rover", "password": "s3cret"}
LAMP = {"fields": {"power": {"type": "text"}}, "payload": "value", "safe": {}}


def both(url: str, safety: dict[str, Any] | None = None, **params: Any) -> tuple[MqttPublish, MqttPublisherState]:
    told = {"broker": url, "topic": TOPIC, "fields": DRIVE, "safe": {"lamp": False}, **params}
    commands, state = build(MqttPublishConfigurer, params=told, safety=safety)
    assert isinstance(commands, MqttPublish)
    assert isinstance(state, MqttPublisherState)
    return commands, state


class Robot:
    """Who listens on the topic, as the machine that moves would."""

    def __init__(self, port: int) -> None:
        self._came = threading.Condition()
        self.heard: list[bytes] = []
        self.retained: list[bool] = []
        self._is_subscribed = threading.Event()
        self._client = Client(CallbackAPIVersion.VERSION2, protocol=MQTTProtocolVersion.MQTTv5)
        self._client.on_message = self._on_message
        self._client.on_subscribe = lambda *_: self._is_subscribed.set()
        self._client.connect("127.0.0.1", port)
        self._client.subscribe(TOPIC, 1)
        self._client.loop_start()
        assert self._is_subscribed.wait(5)

    def _on_message(self, client: Client, data: Any, message: MQTTMessage) -> None:
        with self._came:
            self.heard.append(bytes(message.payload))
            self.retained.append(message.retain)
            self._came.notify_all()

    def wait_for(self, count: int) -> list[bytes]:
        """The first ``count`` payloads."""
        with self._came:
            assert self._came.wait_for(lambda: len(self.heard) >= count, 5), self.heard
            return self.heard[:count]

    def commands(self, count: int) -> list[Any]:
        return [json.loads(one) for one in self.wait_for(count)]

    def leave(self) -> None:
        self._client.disconnect()
        self._client.loop_stop()


@contextmanager
def listening(broker: Mosquitto) -> Iterator[Robot]:
    robot = Robot(broker.port)
    try:
        yield robot
    finally:
        robot.leave()


@contextmanager
def attended(state: MqttPublisherState) -> Iterator[None]:
    """The connection stands in this block, as while the handler runs on its thread."""
    fake_host(state).arm()
    ended: list[BaseException] = []
    is_connected = threading.Event()

    def run() -> None:
        try:
            for _ in state.messages():
                is_connected.set()
        except DeviceGone as error:
            ended.append(error)
        is_connected.set()

    body = threading.Thread(target=run)
    body.start()
    assert is_connected.wait(5)
    try:
        yield
    finally:
        fake_host(state).stop()
        body.join(5)
        assert not body.is_alive()
    if ended:
        raise ended[0]


def test_a_command_is_published_and_silence_a_stop_and_a_leaving_operator_publish_the_safe_one(
    broker: Mosquitto,
) -> None:
    for end in (Silence(1.0), Leaves(), Stopped()):
        commands, state = both(broker.url)
        with listening(broker) as robot:
            with attended(state):
                feed(commands, [GO, end])
                assert robot.commands(3)[:3] == [SAFE, GO, SAFE], end  # opened, commanded, made safe
            assert json.loads(robot.wait_for(len(robot.heard))[-1]) == SAFE
    assert (commands.timeout_s, commands.requires_lease, commands.delivery) == (0.5, True, Delivery.LATEST)


def test_limits_and_the_time_out_of_the_file_hold(broker: Mosquitto) -> None:
    commands, state = both(broker.url, {"timeout_s": 0.2, "limits": {"speed_mps": {"min": -0.1, "max": 0.1}}})
    with listening(broker) as robot, attended(state):
        fed = feed(commands, [{**GO, "speed_mps": 9.0}, '{"speed_mps": NaN}', b"\xff", {"lamp": True}, Silence(0.3)])
        assert robot.commands(2)[1] == {"speed_mps": 0.1, "lamp": True}
    assert len(fed.refused) == 3
    assert [one.cause for one in fed.made_safe] == ["safety.timeout"]


def test_what_moves_nothing_is_published_as_it_is_and_nothing_follows(broker: Mosquitto) -> None:
    commands, state = both(broker.url, **LAMP)
    with listening(broker) as robot:
        with attended(state):
            fed = feed(commands, [{"power": "on"}, Silence(60), {"power": "grün"}])
            assert robot.wait_for(2) == [b"on", "grün".encode()]
        assert robot.heard == [b"on", "grün".encode()]
    assert (fed.made_safe, commands.timeout_s, commands.delivery) == ([], None, Delivery.RELIABLE)


def test_while_the_broker_is_away_for_thirty_seconds_commands_are_dropped_and_its_return_begins_with_the_safe_one(
    stopped_broker: Mosquitto,
) -> None:
    commands, state = both(stopped_broker.url, qos=1)
    with pytest.raises(DeviceGone, match="can't be used"):
        list(state.messages())
    assert [one.code for one in feed(commands, [GO]).refused] == ["plugin.no_device"]

    stopped_broker.start()
    with listening(stopped_broker) as robot, attended(state):
        assert robot.commands(1) == [SAFE]
        feed(commands, [GO])
        assert robot.commands(2) == [SAFE, GO]

    fake_host(state).arm()
    with closing(iter(state.messages())) as messages:
        next(messages)
        stopped_broker.stop()
        with pytest.raises(DeviceGone, match="is lost"):
            next(messages)
    dropped = feed(commands, [GO, GO, GO, Leaves()])
    assert [one.code for one in dropped.refused] == ["plugin.no_device"] * 3
    for _ in thirty_seconds(fake_host(state).clock):
        with pytest.raises(DeviceGone, match="can't be used"):
            collect(state, 1)
        assert [one.code for one in feed(commands, [GO]).refused] == ["plugin.no_device"]

    stopped_broker.start()
    with listening(stopped_broker) as robot:
        with attended(state):
            assert robot.commands(1) == [SAFE]
        assert robot.commands(2) == [SAFE, SAFE]  # opened and closed: nothing of what was dropped comes after all


def test_a_robot_that_dies_leaves_the_safe_command_to_the_broker(broker: Mosquitto) -> None:
    _, state = both(broker.url, retain=True)
    with listening(broker) as robot:
        fake_host(state).arm()
        with state._publication() as publication:
            publication.publish(b'{"speed_mps":0.25,"lamp":true}')
            assert robot.commands(2) == [SAFE, GO]
            own_socket = publication._client.socket()
            assert own_socket is not None
            own_socket.shutdown(socket.SHUT_RDWR)  # as when the machine's plug is pulled: no goodbye
            assert robot.commands(3) == [SAFE, GO, SAFE]
    with listening(broker) as later:
        assert later.commands(1) == [SAFE]
        assert later.retained == [True]


def test_a_flood_is_published_or_told_and_none_of_it_comes_later(broker: Mosquitto) -> None:
    commands, state = both(broker.url, qos=1)
    with listening(broker) as robot:
        taken = []
        with attended(state):
            for number in range(3000):
                with suppress(Refused):
                    commands._link.publish(f'{{"n":{number}}}'.encode())
                    taken.append(number)
        heard = robot.commands(len(taken) + 2)
    assert taken
    assert heard == [SAFE, *({"n": number} for number in taken), SAFE]


CONNACK = b"\x20\x03\x00\x00\x00"
ANSWER_NOBODY_READS = b"\x40\x02\x00\x01"
DISCONNECT = b"\xe0\x00"


@pytest.mark.parametrize("payload", [b"x", b"x" * 1_000_000])
def test_a_broker_that_reads_late_hears_everything_before_the_goodbye(payload: bytes) -> None:
    is_published = threading.Event()
    heard = bytearray()
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            connection, _ = server.accept()
            with connection:
                connection.recv(4096)
                connection.sendall(CONNACK)
                assert is_published.wait(5)
                connection.sendall(ANSWER_NOBODY_READS)
                while piece := connection.recv(65_536):
                    heard.extend(piece)

        with ThreadPoolExecutor(1) as beside:
            serving = beside.submit(serve)
            _, state = both(f"mqtt://127.0.0.1:{server.getsockname()[1]}", qos=1)
            fake_host(state).arm()
            with state._publication() as publication:
                publication.publish(payload)
                own_socket = publication._client.socket()
                is_published.set()
                assert select.select([own_socket], [], [], 5)[0]
            serving.result(5)
    assert payload in heard
    assert heard.endswith(DISCONNECT)


@contextmanager
def deaf_broker() -> Iterator[str]:
    """Lets in who connects, and reads nothing of what comes then."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        is_over = threading.Event()

        def serve() -> None:
            connection, _ = server.accept()
            with connection:
                connection.recv(4096)
                connection.sendall(CONNACK)
                is_over.wait(10)

        thread = threading.Thread(target=serve)
        thread.start()
        try:
            yield f"mqtt://127.0.0.1:{server.getsockname()[1]}"
        finally:
            is_over.set()
            thread.join()


@pytest.mark.parametrize("qos", [0, 1])
def test_a_broker_that_takes_nothing_is_told_and_nothing_piles_up(qos: int) -> None:
    with deaf_broker() as url:
        _, state = both(url, qos=qos)
        fake_host(state).arm()
        with state._publication() as publication:
            with pytest.raises(Refused, match="dropped"):
                collections.deque((publication.publish(b"x" * 20_000) for _ in range(100_000)), maxlen=0)
            publication.make_safe()  # whatever waits
            assert len(publication._client._out_packet) <= 2
            assert len(publication._client._out_messages) <= 16


@pytest.mark.parametrize(
    "answer", [b"\x20\xff\xff\xff\xff", b"\x40\x02", bytes(range(256)), b"HTTP/1.1 200 OK\r\n\r\n"]
)
def test_garbage_of_a_broker_is_a_device_that_is_gone(answer: bytes) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            connection, _ = server.accept()
            with connection:
                connection.recv(4096)
                connection.sendall(b"\x20\x03\x00\x00\x00" + answer)

        thread = threading.Thread(target=serve)
        thread.start()
        _, state = both(f"mqtt://127.0.0.1:{server.getsockname()[1]}")
        with pytest.raises(DeviceGone):
            list(state.messages())
        thread.join()


def test_commands_go_by_tls_with_name_and_password(stopped_broker: Mosquitto) -> None:
    passwords = stopped_broker.knows("rover", "s3cret")
    encrypted = stopped_broker.certified()
    stopped_broker.start("allow_anonymous false", passwords, *encrypted)
    url = f"mqtts://127.0.0.1:{stopped_broker.port}"
    told = {"ca_file": f"{stopped_broker.folder}/cert.pem", "qos": 1, **ROVER}

    commands, state = both(url, **told)
    with attended(state):
        for _ in range(100):
            feed(commands, [GO])
    _, state = both(url, **{**told, "password": "wr0ng"})
    with pytest.raises(DeviceGone, match="refused the connection") as refused:
        list(state.messages())
    assert "wr0ng" not in str(refused.value)


def test_an_operator_sees_whether_there_is_a_broker(stopped_broker: Mosquitto) -> None:
    _, state = both(stopped_broker.url)
    stopped_broker.start()
    stream = iter(state.messages())
    assert next(stream).connected
    stopped_broker.stop()
    with pytest.raises(DeviceGone):
        next(stream)
    assert json.loads(fake_host(state).sent[-1].payload) == {"connected": False}


@pytest.mark.parametrize(
    "params",
    [
        {"topic": "a/#"}, {"topic": "a/+"}, {"topic": "a\0"}, {"topic": ""}, {"fields": {}},
        {"fields": {"model_dump": {}}}, {"payload": "value"}, {"safe": {}}, {"safe": {"lamp": "maybe"}},
        {"safe": {"horn": True}}, {"fields": {"angle_rad": {"kind": "position"}}, "safe": {}}, {"qos": 2},
    ],
)  # fmt: skip
def test_params_that_cannot_be_meant_are_refused(params: dict[str, Any]) -> None:
    with pytest.raises(ConfigError):
        both("fake", **params)


@given(st.text() | st.booleans() | st.floats(allow_nan=False, allow_infinity=False) | st.integers(-(2**53), 2**53))
def test_a_payload_says_what_the_command_says(value: Any) -> None:
    command = {"key": value}
    try:
        assert parsed_value(payload_of(command, "json")) == command
    except (ValueError, UnicodeEncodeError):
        assert isinstance(value, str)  # half a character, which no message of an operator holds
        return
    alone = payload_of(command, "value").decode()
    assert alone == value if isinstance(value, str) else json.loads(alone) == value
