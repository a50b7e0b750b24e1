"""Any process becomes a sensor by sending JSON; what isn't JSON disturbs nobody."""

from __future__ import annotations

import json
import logging
import socket
from typing import Any

import pytest

import mosaic_sensors.udp_socket
from mosaic_core.testing import FakeHost, build, fake_host
from mosaic_core.words.data_type import MosaicDataType
from mosaic_core.words.errors import ConfigError, DeviceGone
from mosaic_sensors.udp_json import UdpJson, UdpJsonConfigurer


class SendingHost(FakeHost):
    """Plays the other process: sends when the handler, bound to its port, first looks whether it shall stop, and
    lets it stop when it has had a look at each datagram."""

    def __init__(self, *datagrams: bytes) -> None:
        super().__init__()
        self.handler: UdpJson | None = None
        self._datagrams = datagrams
        self._looks = 0

    @property
    def is_stopping(self) -> bool:
        if self._looks == 0:
            self._send_all()
        self._looks += 1
        return self._looks > len(self._datagrams)

    def _send_all(self) -> None:
        assert self.handler is not None
        address = self.handler.datagrams.address
        assert address is not None
        family = socket.AF_INET6 if ":" in address[0] else socket.AF_INET
        with socket.socket(family, socket.SOCK_DGRAM) as process:
            for datagram in self._datagrams:
                process.sendto(datagram, address)


def received(*datagrams: bytes, **params: Any) -> tuple[list[dict[str, Any]], UdpJson]:
    handler = build(UdpJsonConfigurer, label="sensor", params={"port": 0, **params})
    host = SendingHost(*datagrams)
    host.handler = handler
    handler.bind(host)
    return list(handler.messages()), handler


def test_a_datagram_becomes_a_message() -> None:
    messages, handler = received(b'{"celsius": 21.5}', b'{"door": "open", "since": [1, 2]}')

    assert messages == [{"celsius": 21.5}, {"door": "open", "since": [1, 2]}]
    assert fake_host(handler).losses == {}
    assert UdpJson.data_type is MosaicDataType.JSON_R2U


def test_only_this_machine_is_listened_to_unless_told_otherwise(caplog: pytest.LogCaptureFixture) -> None:
    _, handler = received(b"{}")

    assert handler.datagrams.address is not None
    assert handler.datagrams.address[0] == "127.0.0.1"
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]


def test_listening_to_the_network_is_warned_of(caplog: pytest.LogCaptureFixture) -> None:
    received(b"{}", host="0.0.0.0")  # noqa: S104 (what the warning is about)

    assert "sensor: anybody who reaches 0.0.0.0 can feed this sensor" in caplog.messages


BAD = [
    b"",
    b"hello",
    b"[1, 2]",
    b"21.5",
    b"null",
    b'{"a": NaN}',
    b'{"a": [1e999]}',
    b'{"a": "\\ud800"}',
    b'{"a": "\xff"}',
    b'{"a":' * 40 + b"1" + b"}" * 40,
    b"[" * 16_000,
]


def test_what_is_no_json_object_is_counted_and_logged_once(caplog: pytest.LogCaptureFixture) -> None:
    messages, handler = received(*BAD, b'{"fine": true}')

    assert messages == [{"fine": True}]
    assert fake_host(handler).losses == {"refused": len(BAD)}
    assert len([record for record in caplog.records if "refused a datagram" in record.message]) == 1


@pytest.mark.parametrize(("size", "accepted"), [(64, 1), (65, 0), (2000, 0)])
def test_datagrams_above_the_limit_are_refused(size: int, accepted: int) -> None:
    datagram = json.dumps({"a": ""}).encode()
    padded = datagram[:-2] + b"x" * (size - len(datagram)) + datagram[-2:]
    assert len(padded) == size

    messages, handler = received(padded, max_bytes=64)
    assert (len(messages), fake_host(handler).losses["refused"]) == (accepted, 1 - accepted)


def test_a_port_in_use_is_an_error_that_names_it() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        port = other.getsockname()[1]

        with pytest.raises(DeviceGone, match=f"can't listen on UDP 127.0.0.1 port {port}"):
            received(port=port)


def test_silence_is_no_reason_to_miss_the_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mosaic_sensors.udp_socket, "RECEIVE_TIMEOUT_S", 0.01)
    handler = build(UdpJsonConfigurer, params={"port": 0})
    looks = iter([False, False, True])
    monkeypatch.setattr(FakeHost, "is_stopping", property(lambda _: next(looks)))

    assert list(handler.messages()) == []


@pytest.mark.parametrize(
    "params", [{}, {"port": 70_000}, {"port": 1, "host": "robot"}, {"port": 1, "max_bytes": 70_000}]
)
def test_params_that_cannot_be_meant_are_refused(params: dict[str, Any]) -> None:
    with pytest.raises(ConfigError):
        build(UdpJsonConfigurer, params=params)
