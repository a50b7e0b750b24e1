"""Devices that speak text over a pseudo terminal: operators say the lines that the file names, and no others."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from typing import Any

import pytest
from support.devices.pty_device import NAME, PtyDevice, plugged_in

from mosaic_core.testing import Silence, build, collect, fake_host, feed
from mosaic_core.words.errors import ConfigError, DeviceGone
from mosaic_sensors.serial_lines.serial_text import SerialText, SerialTextCommands, SerialTextConfigurer


@pytest.fixture
def device(monkeypatch: pytest.MonkeyPatch) -> Iterator[PtyDevice]:
    with plugged_in(monkeypatch) as found:
        yield found


def both(source: str, **params: Any) -> tuple[SerialText, SerialTextCommands]:
    reader, commands = build(SerialTextConfigurer, params={"source": source, **params})
    assert isinstance(reader, SerialText)
    assert isinstance(commands, SerialTextCommands)
    return reader, commands


def test_each_line_is_a_text_and_broken_unicode_is_refused(device: PtyDevice) -> None:
    (reader,) = build(SerialTextConfigurer, params={"source": device.port})
    assert isinstance(reader, SerialText)
    device.greeting = "\xff\xfe\nready, 21 °C\r\n\r\nbye\n".encode("latin-1").replace(b"\xb0", "°".encode())
    assert collect(reader, 2) == ["ready, 21 °C", "bye"]
    assert fake_host(reader).losses == {"refused": 1}


def test_a_flood_of_lines_is_thinned_and_the_last_one_comes(device: PtyDevice) -> None:
    (reader,) = build(SerialTextConfigurer, params={"source": device.port, "max_rate_hz": 8})
    device.greeting = b"waiting\n" * 300
    taken = []
    with closing(iter(reader.messages())) as messages:
        taken.append(next(messages))
        device.says(b"done\n")
        while taken[-1] != "done":
            fake_host(reader).clock.advance(10)
            taken.append(next(messages))
    assert len(taken) <= 5
    assert fake_host(reader).losses == {"thinned": 301 - len(taken)}


def test_a_device_that_is_unplugged_for_thirty_seconds_is_gone_and_then_read_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (reader,) = build(SerialTextConfigurer, params={"source": NAME})
    with plugged_in(monkeypatch) as device, closing(iter(reader.messages())) as messages:
        device.greeting = b"ready\n"
        assert next(messages) == "ready"
        device.unplug()
        with pytest.raises(DeviceGone, match=NAME):
            next(messages)
    for _ in range(6):  # as the robot tries again
        fake_host(reader).clock.advance(5.0)
        with pytest.raises(DeviceGone, match=NAME):
            next(iter(reader.messages()))
    with plugged_in(monkeypatch) as again:
        again.greeting = b"back\n"
        assert collect(reader, 1) == ["back"]


def test_only_lines_of_the_file_reach_the_device(device: PtyDevice) -> None:
    reader, commands = both(device.port, commands=["lamp on", "lamp off"])
    device.greeting = b"ready\n"
    with closing(iter(reader.messages())) as messages:
        next(messages)
        fed = feed(commands, [{"line": "lamp on"}, {"line": "format disk"}, {"line": "lamp on\nformat"}, Silence(60)])
        assert device.heard() == b"lamp on\n"
        assert len(fed.refused) == 2
        assert fed.made_safe == []
    assert device.heard() == b""


def test_lines_that_move_are_followed_by_the_safe_line_on_silence_and_at_both_ends(device: PtyDevice) -> None:
    reader, commands = both(device.port, commands=["up", "down"], safe="halt")
    device.greeting = b"ready\n"
    with closing(iter(reader.messages())) as messages:
        next(messages)
        assert device.heard() == b"\nhalt\n"
        feed(commands, [{"line": "up"}, Silence(0.6)])
        assert device.heard().split() == [b"up", b"halt"]
    assert device.heard() == b"\nhalt\n"


def test_the_choice_of_lines_is_announced() -> None:
    _, commands = both("fake", commands=["up", "down"])
    (model,) = type(commands).__orig_bases__[1].__args__
    assert model.model_json_schema()["properties"]["line"]["enum"] == ["up", "down"]


def test_the_fake_device_repeats_what_it_hears() -> None:
    reader, commands = both("fake", commands=["up"])
    with closing(iter(reader.messages())) as messages:
        assert next(messages) == "uptime 0 s"
        feed(commands, [{"line": "up"}])
        assert next(messages) == "heard: up"


@pytest.mark.parametrize("line", ["", "a\nb", "bell\x07", "x" * 300])
def test_a_line_that_is_none_is_refused_at_once(line: str) -> None:
    with pytest.raises(ConfigError, match="commands"):
        build(SerialTextConfigurer, params={"source": "fake", "commands": [line]})
