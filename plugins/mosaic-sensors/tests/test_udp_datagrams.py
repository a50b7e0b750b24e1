"""Datagrams that come in a burst find room, and what finds none is counted."""

from __future__ import annotations

import socket
import sys
from collections.abc import Iterator

import pytest

import mosaic_sensors.udp_socket
from mosaic_core.contract.handler import DataChannelSendable
from mosaic_core.testing import fake_host
from mosaic_sensors.udp_socket import Datagrams


class Source(DataChannelSendable[bytes]):
    pass


@pytest.fixture
def program() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        yield sender


def burst(program: socket.socket, datagrams: Datagrams, count: int) -> int:
    """How many of ``count`` datagrams arrive that were all sent before the first is read."""
    assert datagrams.address is not None
    for _ in range(count):
        program.sendto(bytes(1024), datagrams.address)
    arrived = 0
    while datagrams.next() is not None:
        arrived += 1
    return arrived


def test_the_buffer_is_as_large_as_the_system_allows() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 * 1024 * 1024)
        allowed_bytes = other.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)
    with Datagrams(Source("sensor"), ("127.0.0.1", 0)) as datagrams:
        assert datagrams._socket is not None
        assert datagrams._socket.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) == allowed_bytes


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells what a socket dropped")
def test_what_finds_no_room_is_counted_in_every_run_and_logged_once(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, program: socket.socket
) -> None:
    monkeypatch.setattr(mosaic_sensors.udp_socket, "_BUFFER_BYTES", 1)
    monkeypatch.setattr(mosaic_sensors.udp_socket, "RECEIVE_TIMEOUT_S", 0.02)
    source = Source("sensor")
    host, datagrams = fake_host(source), Datagrams(source, ("127.0.0.1", 0))
    arrived = 0
    for _ in range(2):
        with datagrams:
            arrived += burst(program, datagrams, 100)
    assert 0 < arrived < 200
    assert host.losses == {"dropped": 200 - arrived}
    assert caplog.text.count("faster than they are read") == 1


def test_refusals_are_logged_again_after_a_while(caplog: pytest.LogCaptureFixture) -> None:
    source = Source("sensor")
    host, datagrams = fake_host(source), Datagrams(source, ("127.0.0.1", 0))
    for pause_s in (0.0, 1.0, 60.0):
        host.clock.advance(pause_s)
        datagrams.refuse(("10.0.0.2", 5005), ValueError("no JSON"))
    assert host.losses == {"refused": 3}
    said = [line for line in caplog.messages if "refused" in line]
    assert said == ["sensor: refused a datagram of 10.0.0.2:5005: no JSON"] * 2
