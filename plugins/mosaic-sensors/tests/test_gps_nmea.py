"""The GPS connector over each of its sources: a file, a TCP server, a serial port (a pseudo terminal)."""

from __future__ import annotations

import os
import socket
import threading
import tty
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import pytest
from support.devices.pty_device import NAME, plugged_in

import mosaic_sensors.byte_source
from mosaic_core.testing import build, collect, fake_host
from mosaic_core.words.errors import ConfigError, DeviceGone
from mosaic_sensors.gps_nmea import GpsNmea, GpsNmeaConfigurer


def sentence(body: str) -> bytes:
    checksum = 0
    for character in body.encode():
        checksum ^= character
    return f"${body}*{checksum:02X}\r\n".encode()


RMC = sentence("GPRMC,092750.000,A,5321.6802,N,00630.3372,W,0.02,31.66,280511,,,A")
GGA = sentence("GPGGA,092750.000,5321.6802,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,")
LATER_GGA = sentence("GPGGA,092751.000,5321.6802,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,")


def gps(source: str, **params: Any) -> GpsNmea:
    return build(GpsNmeaConfigurer, params={"source": source, **params})


@pytest.fixture
def track(tmp_path: Path) -> str:
    path = tmp_path / "track.nmea"
    path.write_bytes(RMC + GGA + b"rubbish\r\n" + LATER_GGA)
    return str(path)


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reads that come back soon: the fake clock decides how long a silence is."""
    monkeypatch.setattr(mosaic_sensors.byte_source, "READ_TIMEOUT_S", 0.01)


def test_a_recording_is_played_at_its_pace(track: str) -> None:
    handler = gps(track, loop=False)
    started_s = fake_host(handler).clock.now_s
    positions = collect(handler)

    assert [position.timestamp for position in positions] == [1306574870_000000, 1306574871_000000]
    assert fake_host(handler).clock.now_s - started_s == pytest.approx(1.0)
    assert [position.bad_lines for position in positions] == [0, 1]
    assert fake_host(handler).losses == {"refused": 1}


def test_the_message_has_the_keys_of_the_original_nav_sat_fix(track: str) -> None:
    handler = gps(track)
    collect(handler, 1)

    sent = fake_host(handler).sent_values()[0]
    assert list(sent)[:4] == ["latitude", "longitude", "altitude", "timestamp"]
    assert sent["latitude"] == pytest.approx(53.36133667)
    assert sent["longitude"] == pytest.approx(-6.50562)
    assert sent["altitude"] == 61.7


def test_what_a_receiver_does_not_say_is_null_under_its_key(track: str) -> None:
    handler = gps(track)
    collect(handler, 1)

    sent = fake_host(handler).sent_values()[0]
    more = {"fix", "satellites", "hdop", "vdop", "speed_mps", "course_rad", "bad_lines"}
    assert set(sent) == {"latitude", "longitude", "altitude", "timestamp", *more}
    assert sent["vdop"] is None


def test_a_recording_is_played_again_until_stop(track: str) -> None:
    handler = gps(track)
    assert len(collect(handler, 5)) == 5

    messages = iter(handler.messages())
    fake_host(handler).stop()
    assert len(list(messages)) <= 1


def test_a_recording_that_does_not_exist_is_an_error_that_names_it() -> None:
    with pytest.raises(FileNotFoundError, match="missing"):
        collect(gps("/missing/track"), 1)


@pytest.fixture
def server() -> Iterator[socket.socket]:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        listening.settimeout(5)
        yield listening


def address(server: socket.socket) -> str:
    return f"tcp://127.0.0.1:{server.getsockname()[1]}"


@contextmanager
def serving(server: socket.socket, *parts: bytes) -> Iterator[None]:
    """Sends ``parts`` to the first who connects, then closes."""

    def serve() -> None:
        connection, _ = server.accept()
        with connection:
            for part in parts:
                connection.sendall(part)

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        yield
    finally:
        thread.join(5)


def test_a_flood_of_sentences_is_read_to_its_end_and_nothing_of_it_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    handler = gps(NAME)
    with plugged_in(monkeypatch) as device, closing(handler.messages()) as messages:
        device.greeting = RMC + (GGA + LATER_GGA) * 25
        stamps = [next(messages).timestamp for _ in range(50)]
        assert stamps == [1306574870_000000, 1306574871_000000] * 25
        device.says(sentence("GPGGA,092759.000,5321.6802,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,"))
        assert next(messages).timestamp == 1306574879_000000
    assert fake_host(handler).losses == {}


def test_positions_come_over_tcp_until_the_server_goes(server: socket.socket) -> None:
    with serving(server, RMC + GGA[:20], GGA[20:]), closing(gps(address(server)).messages()) as messages:
        assert next(messages).latitude == pytest.approx(53.36133667)
        with pytest.raises(DeviceGone, match="closed the connection"):
            next(messages)


def test_a_tcp_server_that_does_not_answer_is_an_error(server: socket.socket) -> None:
    closed = address(server)
    server.close()

    with pytest.raises(DeviceGone, match="refused"):
        collect(gps(closed), 1)


@pytest.fixture
def receiver() -> Iterator[tuple[int, str]]:
    """The GPS receiver's end of a serial line, and the name of ours."""
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    try:
        yield ours, os.ttyname(theirs)
    finally:
        os.close(ours)
        os.close(theirs)


@pytest.fixture
def speaking(receiver: tuple[int, str], monkeypatch: pytest.MonkeyPatch) -> str:
    """A receiver that speaks once our port is open; opening throws away what came before."""
    really_open = mosaic_sensors.byte_source.serial.Serial

    def opening(*arguments: Any, **options: Any) -> Any:
        port = really_open(*arguments, **options)
        os.write(receiver[0], b"half a line\r\n" + RMC + GGA)
        return port

    monkeypatch.setattr(mosaic_sensors.byte_source.serial, "Serial", opening)
    return receiver[1]


@pytest.mark.usefixtures("impatient")
def test_positions_come_over_a_serial_port(receiver: tuple[int, str], speaking: str) -> None:
    handler = gps(speaking)
    with closing(handler.messages()) as messages:
        assert next(messages).bad_lines == 1
        os.write(receiver[0], LATER_GGA)
        assert next(messages).timestamp == 1306574871_000000

        fake_host(handler).stop()
        assert list(messages) == []


def test_a_receiver_that_is_unplugged_for_thirty_seconds_is_gone_and_then_heard_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    handler = gps(NAME)
    with plugged_in(monkeypatch) as device, closing(handler.messages()) as messages:
        device.greeting = GGA
        next(messages)
        device.unplug()
        with pytest.raises(DeviceGone, match=NAME):
            next(messages)
    for _ in range(6):  # as the robot tries again
        fake_host(handler).clock.advance(5.0)
        with pytest.raises(DeviceGone, match=NAME):
            next(handler.messages())
    with plugged_in(monkeypatch) as again:
        again.greeting = RMC + LATER_GGA
        assert collect(handler, 1)[0].timestamp == 1306574871_000000


@pytest.mark.usefixtures("impatient")
def test_a_silent_receiver_is_an_error_that_asks_for_the_baud_rate(
    receiver: tuple[int, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    handler = gps(receiver[1])
    clock = fake_host(handler).clock

    def passing() -> float:
        clock.advance(1.0)
        return clock.now_s

    monkeypatch.setattr(fake_host(handler), "monotonic_s", passing)

    with pytest.raises(DeviceGone, match="no NMEA sentence for 10 s; is 9600 the right baud rate"):
        next(handler.messages())


@pytest.mark.parametrize("source", ["tcp://", "tcp://host", "tcp://host:99999", "tcp://h:1/x", "udp://host:1", ""])
def test_a_source_that_cannot_be_meant_is_refused(source: str) -> None:
    with pytest.raises(ConfigError, match="source"):
        gps(source)
