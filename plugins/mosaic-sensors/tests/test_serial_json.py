"""Devices that speak JSON over a pseudo terminal: what they say arrives, what they are told is within bounds, and they
are made safe at both ends and in between."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import closing
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.devices.pty_device import NAME, PtyDevice, plugged_in

from mosaic_core.testing import Leaves, Silence, Stopped, build, collect, connector, fake_host, feed, joined
from mosaic_core.words.errors import ConfigError, DeviceGone, Refused
from mosaic_sensors.byte_source import WRITE_TIMEOUT_S
from mosaic_sensors.serial_lines.link import LineLink
from mosaic_sensors.serial_lines.serial_json import SerialJson, SerialJsonCommands, SerialJsonConfigurer

COMMANDS = {"left_mps": {"kind": "velocity"}, "right_mps": {"kind": "velocity"}, "lamp": {"type": "boolean"}}
SAFE_LINE = b'\n{"left_mps":0.0,"right_mps":0.0,"lamp":false}\n'
FORWARD = {"left_mps": 0.25, "right_mps": 0.25, "lamp": True}


@pytest.fixture
def device(monkeypatch: pytest.MonkeyPatch) -> Iterator[PtyDevice]:
    with plugged_in(monkeypatch) as found:
        yield found


def sender(source: str, **params: Any) -> SerialJson:
    (handler,) = build(SerialJsonConfigurer, params={"source": source, **params})
    assert isinstance(handler, SerialJson)
    return handler


def both(source: str, safety: dict[str, Any] | None = None, **params: Any) -> tuple[SerialJson, SerialJsonCommands]:
    made = build(
        SerialJsonConfigurer,
        params={"source": source, "commands": COMMANDS, "safe": {"lamp": False}, **params},
        safety=safety,
    )
    one, other = made
    assert isinstance(one, SerialJson)
    assert isinstance(other, SerialJsonCommands)
    return one, other


# -- what it says ------------------------------------------------------------------------------------------------


def test_each_line_is_a_message_wherever_the_line_is_cut(device: PtyDevice) -> None:
    device.greeting = b'{"voltage_v": 12.5}\r\n{"volt'
    with closing(iter(sender(device.port, baud=57_600).messages())) as messages:
        assert next(messages) == {"voltage_v": 12.5}
        device.says(b'age_v": 12}\n')
        assert next(messages) == {"voltage_v": 12}
    assert device.bauds == [57_600]


def test_fields_make_a_typed_message_and_what_does_not_fit_is_refused_and_counted(device: PtyDevice) -> None:
    fields = {"voltage_v": {"unit": "V"}, "is_charging": {"type": "boolean"}}
    handler = sender(device.port, fields=fields)
    device.greeting = (
        b'age": 3}\n\xff\xfe\n[1]\n{"voltage_v": "much", "is_charging": true}\n{"voltage_v": NaN, "is_charging": true}'
        b'\n{"voltage_v": 1}\n{"voltage_v": 12.5, "is_charging": true, "more": 1}\n'
    )
    (message,) = collect(handler, 1)
    assert message.model_dump() == {"voltage_v": 12.5, "is_charging": True}
    assert fake_host(handler).losses == {"refused": 6}
    assert type(message).model_json_schema()["properties"]["voltage_v"]["unit"] == "V"


def test_a_line_that_never_ends_is_refused_and_the_next_one_arrives(device: PtyDevice) -> None:
    handler = sender(device.port, max_line_bytes=64)
    device.greeting = b"x" * 2000 + b'\n{"a": 1}\n'
    assert collect(handler, 1) == [{"a": 1}]
    assert fake_host(handler).losses == {"refused": 1}


def test_a_flood_is_thinned_and_counted(device: PtyDevice) -> None:
    handler = sender(device.port, max_rate_hz=8)
    device.greeting = b'{"a": 1}\n' * 300
    with closing(iter(handler.messages())) as messages:
        taken = [next(messages), next(messages)]
        device.says(b'{"a": 2}\n')
        fake_host(handler).clock.advance(10)
        while taken[-1] != {"a": 2}:
            taken.append(next(messages))
    assert len(taken) <= 5
    assert fake_host(handler).losses == {"thinned": 301 - len(taken)}


def test_a_device_that_is_unplugged_for_thirty_seconds_is_gone_and_then_read_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    handler = sender(NAME)
    with plugged_in(monkeypatch) as device, closing(iter(handler.messages())) as messages:
        device.greeting = b'{"n": 1}\n'
        assert next(messages) == {"n": 1}
        device.unplug()
        with pytest.raises(DeviceGone, match=NAME):
            next(messages)
    for _ in range(6):  # as the robot tries again
        fake_host(handler).clock.advance(5.0)
        with pytest.raises(DeviceGone, match=NAME):
            next(iter(handler.messages()))
    with plugged_in(monkeypatch) as again:
        again.greeting = b'{"n": 2}\n'
        assert collect(handler, 1) == [{"n": 2}]


def test_a_silent_device_is_opened_again_if_the_file_says_so(
    device: PtyDevice, monkeypatch: pytest.MonkeyPatch
) -> None:
    handler = sender(device.port, silence_s=3, baud=9600)
    clock = fake_host(handler).clock
    monkeypatch.setattr(fake_host(handler), "monotonic_s", lambda: (clock.advance(1.0), clock.now_s)[1])
    with pytest.raises(DeviceGone, match="no line for 3 s; is 9600 the right baud rate"):
        next(iter(handler.messages()))


@given(st.lists(st.binary(max_size=80), max_size=20))
def test_whatever_a_device_says_nothing_but_objects_arrive(said: list[bytes]) -> None:
    handler = sender("fake")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(handler.reader, "lines", lambda: (one for one in [*said, b'{"end": 1}']))
        found = list(handler.messages())
    assert all(isinstance(one, dict) for one in found)
    assert found[-1] == {"end": 1}
    assert len(found) + fake_host(handler).losses["refused"] == len(said) + 1


# -- what it is told ---------------------------------------------------------------------------------------------


def test_a_command_is_a_line_and_silence_a_stop_and_a_leaving_operator_say_the_safe_line(device: PtyDevice) -> None:
    reader, commands = both(device.port)
    device.greeting = b"{}\n"
    with closing(iter(reader.messages())) as messages:
        next(messages)
        assert device.heard() == b"\n" + SAFE_LINE[1:]
        for end, cause in ((Silence(1.0), "safety.timeout"), (Leaves(), ""), (Stopped(), "")):
            fed = feed(commands, [FORWARD, end])
            lines = device.heard().splitlines()
            assert json.loads(lines[0]) == FORWARD
            assert set(lines[1:]) == {SAFE_LINE[1:-1]}, end
            assert not cause or fed.made_safe[0].cause == cause
    assert device.heard() == SAFE_LINE


def test_limits_of_the_file_hold_and_what_is_no_command_never_reaches_the_device(device: PtyDevice) -> None:
    reader, commands = both(device.port, {"limits": {"left_mps": {"min": -0.3, "max": 0.3}}})
    device.greeting = b"{}\n"
    with closing(iter(reader.messages())) as messages:
        next(messages)
        device.heard()
        fed = feed(commands, [{**FORWARD, "left_mps": 9.0}, {"left_mps": 1}, '{"left_mps": NaN}', b"\xff"])
        assert json.loads(device.heard().splitlines()[0])["left_mps"] == 0.3
        assert len(fed.refused) == 3


def test_while_the_device_is_away_commands_are_refused_and_its_return_begins_with_the_safe_line(
    device: PtyDevice,
) -> None:
    reader, commands = both(device.port)
    fed = feed(commands, [FORWARD])
    assert [one.code for one in fed.refused] == ["plugin.no_device"]
    device.greeting = b"{}\n"
    collect(reader, 1)
    assert device.heard() == SAFE_LINE * 2  # opened, closed


class Jammed:
    """A line that takes nothing any more."""

    def __init__(self) -> None:
        self.is_jammed = False
        self.taken: list[bytes] = []

    def read(self) -> bytes:
        return b""

    def write(self, data: bytes) -> None:
        if self.is_jammed:
            raise TimeoutError(f"nothing taken for {WRITE_TIMEOUT_S} s")
        self.taken.append(data)

    def set_dtr(self, is_on: bool) -> None:
        """It has none."""


def test_a_line_that_takes_nothing_is_lost_and_the_safe_action_does_not_raise() -> None:
    line, link = Jammed(), LineLink(b"safe")
    with link.carried_by(line):
        line.is_jammed = True
        with pytest.raises(Refused, match="took nothing"):
            link.write(b"go")
        assert isinstance(link.failure, TimeoutError)
        link.make_safe()
        line.is_jammed = False
        with pytest.raises(Refused, match="isn't open"):
            link.write(b"go")
    assert line.taken == [b"\nsafe\n", b"\nsafe\n"]


async def test_an_operator_of_a_whole_robot_reads_the_fake_and_commands_it() -> None:
    params = {"source": "fake", "commands": {"lamp": {"type": "boolean"}}}
    async with joined(connector(SerialJsonConfigurer, label="base", params=params)) as link:
        message = await link.connection.receivable("base").next_message()
        assert "uptime_s" in message.json()


@pytest.mark.parametrize(
    ("params", "said"),
    [
        ({"source": "recorded.json"}, "no source"),
        ({"source": "tcp://host"}, "write tcp://host:port"),
        ({"fields": {"a b": {}}}, "no name"),
        ({"fields": {"_x": {}}}, "no name"),
        ({"fields": {"copy": {}}}, "meaning of its own"),
        ({"commands": {"lamp": {"type": "boolean"}}, "safe": {"lamb": False}}, "not among the commands"),
        ({"commands": {"lamp": {"type": "boolean"}}, "safe": {"lamp": "perhaps"}}, "safe: lamp"),
    ],
)
def test_what_cannot_be_meant_is_refused_at_once(params: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        build(SerialJsonConfigurer, params=params)
