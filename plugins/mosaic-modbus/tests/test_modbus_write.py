"""Commands to a real server: within limits, and the safe values at both ends and in between."""

from __future__ import annotations

import itertools
import threading
from typing import Any

import pytest
from pymodbus.constants import ExcCodes
from support.devices.absence import thirty_seconds
from support.devices.modbus_device import Lines, ModbusDevice, SerialCable

from mosaic_core.testing import (
    Leaves,
    LosesLease,
    Silence,
    Stopped,
    build,
    connector,
    fake_host,
    feed,
    joined,
    until,
)
from mosaic_core.words.errors import ConfigError, DeviceGone
from mosaic_modbus.kept_line import KeptLine
from mosaic_modbus.write import ModbusWriteConfigurer

FIELDS: dict[str, Any] = {
    "speed_rpm": {"address": 4, "type": "int16", "motion": "velocity", "min": -100, "max": 100},
    "current_a": {"address": 5, "scale": 0.1, "max": 20, "safe": 0},
    "mode": {"address": 9},
    "enable": {"address": 3, "kind": "coil", "safe": False},
}
COMMAND = {"speed_rpm": -50, "current_a": 12.5, "mode": 2, "enable": True}
WRITTEN = [(5, 3, [True]), (16, 4, [65_486, 125]), (6, 9, [2])]
SAFE = [(5, 3, [False]), (16, 4, [0, 0])]
FAST = {"slow_down": "off"}


def on_line(
    lines: Lines, source: str, safety: Any = None, fields: Any = None, timeout_s: float = 2.0
) -> tuple[KeptLine, Any]:
    """A line that is not open, and a receiver on it."""
    its = FIELDS if fields is None else fields
    made: tuple[KeptLine, Any] = lines.build(
        ModbusWriteConfigurer, source, timeout_s=timeout_s, safety={**FAST, **(safety or {})}, fields=its
    )
    return made


def opened(line: KeptLine) -> None:
    """As its thread does."""
    line.open()
    line.pay()


@pytest.mark.parametrize("end", [Silence(0.6), Leaves(), LosesLease(), Stopped()])
def test_a_command_is_written_and_its_operators_absence_writes_the_safe_values(
    lines: Lines, device: ModbusDevice, port: int, end: Any
) -> None:
    line, handler = on_line(lines, f"tcp://127.0.0.1:{port}")
    opened(line)
    assert device.written() == SAFE
    fed = feed(handler, [COMMAND, end])
    assert len(fed.accepted) == 1
    found = device.written()
    assert found[:3] == WRITTEN
    assert found[3:5] == SAFE
    line.close()
    assert device.written()[-2:] == SAFE


def test_rtu_over_a_serial_line_writes_the_same(lines: Lines, serial: ModbusDevice, cable: SerialCable) -> None:
    line, handler = on_line(lines, cable.port)
    opened(line)
    feed(handler, [COMMAND])
    assert serial.written()[:5] == SAFE + WRITTEN


def test_limits_hold_and_what_is_no_command_is_never_written(lines: Lines, device: ModbusDevice, port: int) -> None:
    line, handler = on_line(lines, f"tcp://127.0.0.1:{port}", {"limits": {"speed_rpm": {"max": 30}}})
    opened(line)
    device.written()
    fed = feed(
        handler,
        [{**COMMAND, "speed_rpm": 5000}, {**COMMAND, "current_a": 20.1}, {**COMMAND, "mode": -1}, {"speed_rpm": 1},
         b"\xff", '{"speed_rpm": NaN, "current_a": 1, "mode": 1, "enable": true}'],
    )  # fmt: skip
    assert device.written()[1] == (16, 4, [30, 125])
    assert len(fed.refused) == 5


def test_the_robots_file_never_widens_a_range(lines: Lines, device: ModbusDevice, port: int) -> None:
    line, handler = on_line(lines, f"tcp://127.0.0.1:{port}", {"limits": {"speed_rpm": {"max": 3000, "min": -3000}}})
    opened(line)
    fed = feed(handler, [{**COMMAND, "speed_rpm": 101}])
    assert [one.code for one in fed.refused] == ["safety.out_of_range"]


def test_a_device_that_says_no_is_quoted_and_gets_its_safe_values_before_any_command(
    lines: Lines, device: ModbusDevice, port: int
) -> None:
    line, handler = on_line(lines, f"tcp://127.0.0.1:{port}")
    opened(line)
    device.says_no = ExcCodes.DEVICE_FAILURE
    (refused,) = feed(handler, [COMMAND]).refused
    assert "refused coil 3: device failure (exception 4)" in refused.message
    line.pay()
    (refused,) = feed(handler, [COMMAND]).refused
    assert "safe values have not been written yet: device failure" in refused.message
    device.says_no = None
    device.written()
    line.pay()
    assert device.written() == SAFE
    assert len(feed(handler, [COMMAND]).accepted) == 1


def test_a_server_that_is_away_for_thirty_seconds_refuses_commands_and_its_return_begins_with_the_safe_values(
    lines: Lines, device: ModbusDevice, port: int
) -> None:
    line, handler = on_line(lines, f"tcp://127.0.0.1:{port}")
    assert [one.code for one in feed(handler, [COMMAND]).refused] == ["plugin.no_device"]
    opened(line)
    device.switch_off()
    assert [one.code for one in feed(handler, [COMMAND, Stopped()]).refused] == ["plugin.no_device"]
    for _ in thirty_seconds(fake_host(handler).clock):
        with pytest.raises(DeviceGone, match="can't be opened"):
            line.open()
        assert [one.code for one in feed(handler, [COMMAND, Stopped()]).refused] == ["plugin.no_device"]
    device.asked.clear()
    device.switch_on()
    opened(line)
    assert device.written() == SAFE


def test_a_flood_of_commands_is_written_one_by_one_and_nothing_of_it_comes_after_a_stop(
    lines: Lines, device: ModbusDevice, port: int
) -> None:
    line, handler = on_line(lines, f"tcp://127.0.0.1:{port}")
    opened(line)
    device.written()
    speeds = [number % 100 for number in range(200)]
    feed(handler, [*({**COMMAND, "speed_rpm": speed} for speed in speeds), Stopped()])
    found = device.written()
    assert [words[0] for _, address, words in found if address == 4] == [*speeds, 0]
    assert found[-2:] == SAFE


def test_a_serial_device_that_is_silent_is_made_safe_once_it_answers(
    lines: Lines, serial: ModbusDevice, cable: SerialCable
) -> None:
    line, handler = on_line(lines, cable.port, timeout_s=0.2)
    opened(line)
    cable.is_cut = True
    (refused,) = feed(handler, [COMMAND]).refused
    assert "does not answer" in refused.message
    cable.is_cut = False
    serial.written()
    line.pay()
    assert serial.written() == SAFE


def test_a_stop_in_the_middle_of_a_command_ends_it(lines: Lines, device: ModbusDevice, port: int) -> None:
    line, handler = on_line(lines, f"tcp://127.0.0.1:{port}")
    opened(line)
    write, done = line.write, threading.Event()

    def stopped_after_the_first(*words: Any, **options: Any) -> None:
        write(*words, **options)
        if not done.is_set():
            done.set()
            handler.make_safe("safety.stop")

    line.write = stopped_after_the_first  # type: ignore[method-assign]
    device.written()
    fed = feed(handler, [COMMAND])
    assert [one.code for one in fed.refused] == ["safety.stopped"]
    assert device.written()[:3] == [WRITTEN[0], *SAFE]


def test_what_moves_nothing_and_says_no_safe_value_is_left_as_it_is(
    lines: Lines, device: ModbusDevice, port: int
) -> None:
    line, handler = on_line(lines, f"tcp://127.0.0.1:{port}", fields={"mode": {"address": 9}})
    opened(line)
    fed = feed(handler, [{"mode": 3}, Stopped()])
    assert (len(fed.accepted), handler.timeout_s) == (1, None)
    assert device.written() == [(6, 9, [3])]


async def test_a_whole_robot_drives_it_and_ends_with_the_safe_values(device: ModbusDevice, port: int) -> None:
    params = {"line": {"source": f"tcp://127.0.0.1:{port}"}, "fields": FIELDS}
    made = connector(ModbusWriteConfigurer, label="drive", params=params, safety=FAST)
    found: list[Any] = []

    def has(wanted: list[Any]) -> bool:
        found.extend(device.written())
        return all(one in found for one in wanted)

    async with joined(made, takes_leases=True) as link:
        await until(lambda: has(SAFE))
        store = link.connection.sendable("drive")
        await store.wait_open()
        await until(lambda: store.send_json(COMMAND) and has(WRITTEN))
        device.switch_off()
        rows = link.robot.snapshot
        gone = "plugin.no_device"
        await until(lambda: store.send_json(COMMAND) and rows().connectors[0].failure_code == gone, "it is away")
        device.switch_on()
        found.clear()
        hand = itertools.cycle([{**COMMAND, "speed_rpm": 0, "current_a": 0}, COMMAND])  # lets go first
        await until(lambda: store.send_json(next(hand)) and has(WRITTEN), "it is driven again")
        assert found[:2] == SAFE
    found.extend(device.written())
    assert found[-2:] == SAFE


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"a": {"address": 1, "type": "int32"}, "b": {"address": 2}}, "a and b lie in the same register"),
        ({"a": {"address": 1, "min": 70_000}}, "leave nothing"),
        ({"a": {"address": 1, "motion": "velocity", "min": 5}}, "0 must stand still"),
        ({"a": {"address": 1, "max": 5, "safe": 6}}, "a: safe: 6 is not within 0 to 5"),
        ({"copy": {"address": 1}}, "meaning of its own"),
    ],
)
def test_what_cannot_be_meant_is_refused_at_once(fields: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        build(ModbusWriteConfigurer, params={"fields": fields})
