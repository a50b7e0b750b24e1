"""A broker's messages reach operators; a broker that is gone, floods or talks nonsense harms nobody."""

from __future__ import annotations

import json
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from support.devices.absence import thirty_seconds

from mosaic_core.testing import build, collect, fake_host
from mosaic_core.words.data_type import MosaicDataType
from mosaic_core.words.errors import ConfigError, DeviceGone
from mosaic_mqtt.subscribe import MqttBytes, MqttJson, MqttSubscribeConfigurer, MqttText

if TYPE_CHECKING:
    from conftest import Mosquitto


def subscriber(url: str, topic: str = "a/#", **params: Any) -> Any:
    return build(MqttSubscribeConfigurer, params={"broker": url, "topic": topic, **params})


def values(handler: Any, count: int) -> list[Any]:
    return [message.value for message in collect(handler, count)]


def test_what_the_broker_kept_comes_at_once_with_its_topic(broker: Mosquitto) -> None:
    broker.keep(("a/x", '{"celsius": 21.5}'), ("b/x", "1"))

    (message,) = collect(subscriber(broker.url), 1)
    assert message.model_dump() == {"topic": "a/x", "retained": True, "value": {"celsius": 21.5}}


def test_what_is_published_later_follows_and_is_not_called_kept(broker: Mosquitto) -> None:
    broker.keep(("a/x", "1"))
    stream = iter(subscriber(broker.url, qos=1).messages())

    first = next(stream)  # it is subscribed now
    broker.keep(("a/x", "2"))
    second = next(stream)
    stream.close()
    assert [(one.value, one.retained) for one in (first, second)] == [(1, True), (2, False)]


def test_text_and_bytes_come_as_they_are(broker: Mosquitto) -> None:
    broker.keep(("a/x", b"gr\xc3\xbcn"))

    assert collect(subscriber(broker.url, format="text"), 1) == ["grün"]
    assert collect(subscriber(broker.url, format="bytes"), 1) == [b"gr\xc3\xbcn"]
    assert (MqttJson.data_type, MqttText.data_type, MqttBytes.data_type) == (
        MosaicDataType.JSON_R2U, MosaicDataType("string-r2u"), MosaicDataType("byte-r2u")
    )  # fmt: skip


GARBAGE = [b"{", b"\xff", b'{"a": NaN}', b'"\\ud800"', b"[" * 40 + b"]" * 40, b"[" * 20_000]


def test_garbage_is_counted_and_told_once(broker: Mosquitto, caplog: pytest.LogCaptureFixture) -> None:
    broker.keep(*((f"a/{index}", payload) for index, payload in enumerate(GARBAGE)))
    broker.keep(("a/last", "true"))
    handler = subscriber(broker.url)

    assert values(handler, 1) == [True]
    told = [one for one in caplog.messages if "refused a message" in one]
    assert (fake_host(handler).losses, len(told)) == ({"refused": len(GARBAGE)}, 1)


def test_text_that_is_none_is_refused(broker: Mosquitto) -> None:
    broker.keep(("a/1", b"\xff"), ("a/2", "fine"))
    handler = subscriber(broker.url, format="text")

    assert collect(handler, 1) == ["fine"]
    assert fake_host(handler).losses == {"refused": 1}


def test_a_message_that_is_too_large_stays_with_the_broker(broker: Mosquitto) -> None:
    broker.keep(("a/1", json.dumps("x" * 2000)), ("a/2", '"small"'))

    assert values(subscriber(broker.url, max_bytes=1000), 1) == ["small"]


def test_a_flood_waits_where_it_is_bounded_and_arrives_whole(broker: Mosquitto) -> None:
    broker.keep(*((f"a/{index}", str(index)) for index in range(1500)))
    handler = subscriber(broker.url)
    longest = 0
    subscription = handler._subscription()
    with subscription:
        for _ in range(1500):
            while subscription.next() is None:
                pass
            longest = max(longest, len(subscription._inbox))

    assert longest < 64


def test_a_broker_that_is_away_for_thirty_seconds_is_a_device_that_is_gone_and_one_that_returns_is_used(
    stopped_broker: Mosquitto,
) -> None:
    handler = subscriber(stopped_broker.url)
    with pytest.raises(DeviceGone, match="can't be used"):
        collect(handler, 1)

    stopped_broker.start()
    stopped_broker.keep(("a/x", "1"))
    fake_host(handler).arm()
    stream = iter(handler.messages())
    assert next(stream).value == 1
    stopped_broker.stop()
    with pytest.raises(DeviceGone, match="is lost"):
        next(stream)
    for _ in thirty_seconds(fake_host(handler).clock):
        with pytest.raises(DeviceGone, match="can't be used"):
            collect(handler, 1)

    stopped_broker.start()
    stopped_broker.keep(("a/x", "2"))
    assert values(handler, 1) == [2]


@contextmanager
def answering(answer: bytes) -> Iterator[str]:
    """A server that gives ``answer`` to whoever connects, and then closes."""
    with socket.create_server(("127.0.0.1", 0)) as listening:

        def serve() -> None:
            connection, _ = listening.accept()
            with connection:
                connection.recv(4096)
                connection.sendall(answer)

        thread = threading.Thread(target=serve)
        thread.start()
        yield f"mqtt://127.0.0.1:{listening.getsockname()[1]}"
        thread.join()


@pytest.mark.parametrize(
    "answer", [b"", b"HTTP/1.1 400 Bad Request\r\n\r\n", b"\x20\x03\x00", b"\x20\x02\x00\x00", b"\x20\xff\xff\xff\xff",
               b"\x30\x05\x00\xff\xff\xff\xff", b"\x20\x06\x00\x00\x03\xff\xff\xff", bytes(range(256))]
)  # fmt: skip
def test_bytes_that_are_no_mqtt_are_a_device_that_is_gone(answer: bytes) -> None:
    with answering(answer) as url, pytest.raises(DeviceGone):
        collect(subscriber(url), 1)


def test_no_try_leaves_anything_open(broker: Mosquitto) -> None:
    broker.keep(("a/x", "1"))

    def try_all() -> int:
        assert values(subscriber(broker.url), 1) == [1]
        for answer in (b"", b"HTTP/1.1 400 Bad Request\r\n\r\n"):
            with answering(answer) as url, pytest.raises(DeviceGone):
                collect(subscriber(url), 1)
        return len(list(Path("/dev/fd").iterdir()))

    before = try_all()
    assert [try_all() for _ in range(5)] == [before] * 5


ROVER = {"username": "rover", "password": "s3cret"}


def test_a_wrong_password_is_told_with_its_cure_and_the_right_one_lets_in(stopped_broker: Mosquitto) -> None:
    stopped_broker.start("allow_anonymous false", stopped_broker.knows("rover", "s3cret"))

    with pytest.raises(DeviceGone, match=r"refused the connection.*check username") as refused:
        collect(subscriber(stopped_broker.url, **{**ROVER, "password": "wr0ng"}), 1)
    assert "wr0ng" not in str(refused.value)

    handler = subscriber(stopped_broker.url, **ROVER)
    with handler._subscription():
        assert "s3cret" not in repr(handler.params)


def test_an_encrypted_broker_is_trusted_by_its_certificate_alone(stopped_broker: Mosquitto) -> None:
    folder, port = stopped_broker.folder, stopped_broker.port
    stopped_broker.start("allow_anonymous true", *stopped_broker.certified())
    url = f"mqtts://127.0.0.1:{port}"

    with subscriber(url, ca_file=f"{folder}/cert.pem")._subscription():
        pass
    with pytest.raises(DeviceGone, match="certificate"):
        collect(subscriber(url), 1)
    with pytest.raises(DeviceGone, match="can't be read"):
        collect(subscriber(url, ca_file="/nowhere.pem"), 1)


def test_a_made_up_broker_speaks_at_once_and_each_second() -> None:
    handler = subscriber("fake", "house/+/climate")

    messages = collect(handler, 3)
    assert [one.retained for one in messages] == [True, False, False]
    assert messages[0].topic == "house/fake/climate"


@pytest.mark.parametrize(
    "params",
    [
        {}, {"broker": "localhost", "topic": "a"}, {"broker": "mqtt://", "topic": "a"},
        {"broker": "mqtt://h:99999", "topic": "a"}, {"broker": "mqtt://me:pw@h", "topic": "a"},
        {"broker": "mqtt://h/path", "topic": "a"}, {"topic": ""}, {"topic": "a/#/b"}, {"topic": "a+"},
        {"topic": "a", "password": "x"}, {"topic": "a", "ca_file": "ca.pem"}, {"topic": "a", "qos": 2},
    ],
)  # fmt: skip
def test_params_that_cannot_be_meant_are_refused(params: dict[str, Any]) -> None:
    with pytest.raises(ConfigError):
        build(MqttSubscribeConfigurer, params=params)
