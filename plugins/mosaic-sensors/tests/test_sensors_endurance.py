"""Receivers and programs that vanish and return, talk without end, or say nonsense."""

from __future__ import annotations

import json
import socket
from collections.abc import Callable, Iterator
from contextlib import closing
from typing import Any

import numpy as np
import pytest
from support.devices.absence import AWAY_S
from support.devices.pty_device import NAME, PtyDevice, plugged_in

from mosaic_core.contract.configurer import Configurer
from mosaic_core.testing import FakeHost, build, collect, connector, fake_host, joined, until
from mosaic_core.words.errors import DeviceGone
from mosaic_sensors.gps_nmea import GpsNmea, GpsNmeaConfigurer
from mosaic_sensors.laser_scan.udp import LaserScanConfigurer
from mosaic_sensors.lines import MAX_LINE_BYTES
from mosaic_sensors.point_cloud.connector import PointCloudConfigurer
from mosaic_sensors.point_cloud.datagrams import datagrams_of
from mosaic_sensors.serial_lines.serial_text import SerialText, SerialTextConfigurer
from mosaic_sensors.udp_json import UdpJsonConfigurer

RMC = b"$GPRMC,092750.000,A,5321.6802,N,00630.3372,W,0.02,31.66,280511,,,A*43\r\n"
GGA = b"$GPGGA,092750.000,5321.6802,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,*76\r\n"
LATER_GGA = b"$GPGGA,092751.000,5321.6802,N,00630.3371,W,1,8,1.03,61.7,M,55.3,M,,*75\r\n"
EPOCH = RMC + GGA + LATER_GGA


@pytest.fixture
def device(monkeypatch: pytest.MonkeyPatch) -> Iterator[PtyDevice]:
    with plugged_in(monkeypatch) as found:
        yield found


def gps(source: str) -> GpsNmea:
    return build(GpsNmeaConfigurer, params={"source": source})


def text(source: str, **params: Any) -> SerialText:
    (handler,) = build(SerialTextConfigurer, params={"source": source, **params})
    assert isinstance(handler, SerialText)
    return handler


@pytest.mark.parametrize(("make", "greeting"), [(gps, EPOCH), (text, b"ready\n")])
def test_what_is_unplugged_for_thirty_seconds_is_gone_and_then_heard_again(
    make: Callable[[str], Any], greeting: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    handler = make(NAME)
    with plugged_in(monkeypatch) as device, closing(iter(handler.messages())) as messages:
        device.greeting = greeting
        next(messages)
        device.unplug()
        with pytest.raises(DeviceGone, match=NAME):
            list(messages)
    for _ in range(6):  # as the robot tries again
        fake_host(handler).clock.advance(5.0)
        with pytest.raises(DeviceGone, match=NAME):
            next(iter(handler.messages()))
    with plugged_in(monkeypatch) as again:
        again.greeting = greeting
        assert len(collect(handler, 1)) == 1


def test_a_receiver_at_the_wrong_speed_is_counted_and_costs_no_memory_nor_position(device: PtyDevice) -> None:
    handler = gps(device.port)
    device.greeting = b"\xf0\x1e" * MAX_LINE_BYTES + b"\n" + b"\x00\xff,*\n" * 50 + EPOCH
    (position,) = collect(handler, 1)
    assert position.latitude == pytest.approx(53.36133667)
    assert fake_host(handler).losses == {"refused": 51}
    assert position.bad_lines >= 50


def test_lines_in_a_flood_are_thinned_and_one_without_end_is_refused(device: PtyDevice) -> None:
    handler = text(device.port, max_rate_hz=8, max_line_bytes=64)
    device.greeting = b"x" * 2000 + b"\n" + b"hot\n" * 300
    with closing(iter(handler.messages())) as messages:
        taken = [next(messages), next(messages)]
        device.says(b"cold\n")
        fake_host(handler).clock.advance(10)
        while taken[-1] != "cold":
            taken.append(next(messages))
    assert len(taken) <= 5
    assert fake_host(handler).losses == {"refused": 1, "thinned": 301 - len(taken)}


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


SCAN = json.dumps({"ranges": [1, None], "angle_min": 0, "angle_increment": 1}).encode()
CLOUD = list(datagrams_of(np.ones((20, 3), np.float32), 1))


BY_DATAGRAMS = pytest.mark.parametrize(
    ("configurer", "params", "said"),
    [
        (UdpJsonConfigurer, lambda port: {"port": port}, [b'{"celsius": 21.5}']),
        (LaserScanConfigurer, lambda port: {"source": f"udp://127.0.0.1:{port}"}, [SCAN]),
        (PointCloudConfigurer, lambda port: {"source": f"udp://127.0.0.1:{port}"}, CLOUD),
    ],
)


class Program(FakeHost):
    """Sends ``said`` to ``port`` as soon as somebody listens there, is away for thirty seconds, and sends it again."""

    def __init__(self, port: int, said: list[bytes]) -> None:
        super().__init__()
        self._steps = [lambda: say(port, said), lambda: self.clock.advance(AWAY_S), lambda: say(port, said)]

    @property
    def is_stopping(self) -> bool:
        if self._steps:
            self._steps.pop(0)()
        return False


def say(port: int, datagrams: list[bytes]) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as program:  # each time another one
        for datagram in datagrams:
            program.sendto(datagram, ("127.0.0.1", port))


@BY_DATAGRAMS
def test_a_program_that_is_away_for_thirty_seconds_is_heard_again_when_it_returns(
    configurer: type[Configurer[Any]], params: Callable[[int], dict[str, Any]], said: list[bytes]
) -> None:
    port = free_port()
    handler = build(configurer, params=params(port))
    one: Any = handler[0] if isinstance(handler, list | tuple) else handler
    host = Program(port, said)
    one.bind(host)
    body = next(getattr(one, name) for name in ("scans", "clouds", "messages") if hasattr(type(one), name))
    with closing(iter(body())) as heard:
        assert next(heard) is not None
        assert next(heard) is not None
    assert host.clock.now_s >= 1000.0 + AWAY_S
    assert host.losses == {}


@BY_DATAGRAMS
async def test_a_program_that_says_nonsense_vanishes_and_returns_is_heard_again(
    configurer: type[Configurer[Any]], params: Callable[[int], dict[str, Any]], said: list[bytes]
) -> None:
    port = free_port()
    async with joined(connector(configurer, label="sensor", params=params(port))) as link:
        store = link.connection.receivable("sensor")
        heard: list[bytes] = []
        store.subscribe(lambda data: heard.append(bytes(data)))

        def says(*datagrams: bytes) -> int:
            say(port, list(datagrams))
            return len(heard)

        await until(lambda: says(*said), "it is heard")
        for _ in range(200):
            says(b"", b"\xff" * 1400, b"{", said[0][:-1])
        before = len(heard)
        await until(lambda: says(*said) > before, "it is heard again")
