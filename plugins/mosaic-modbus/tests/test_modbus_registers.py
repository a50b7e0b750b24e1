"""Registers of a real server, over TCP and over a serial line that can be cut and garbled."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import pytest
from pymodbus import FramerType
from pymodbus.constants import ExcCodes
from support.devices.absence import thirty_seconds
from support.devices.modbus_device import Lines, ModbusDevice, SerialCable, tcp_device

from mosaic_core.contract.devices.shared import Shared
from mosaic_core.contract.handler import message_type_of
from mosaic_core.testing import build, collect, connector, fake_host, joined
from mosaic_core.words.errors import ConfigError, DeviceGone, MosaicError
from mosaic_modbus.kept_line import KeptLine
from mosaic_modbus.registers import ModbusRegistersConfigurer

FIELDS: dict[str, Any] = {
    "speed": {"address": 3, "scale": 0.5, "unit": "m/s"},
    "torque": {"address": 4},
    "energy": {"address": 5, "type": "uint32"},
    "pressure": {"address": 2, "kind": "input"},
    "is_open": {"address": 4, "kind": "discrete"},
    "is_closed": {"address": 5, "kind": "discrete"},
    "is_ready": {"address": 7, "bit": 2},
}
TOLD = {
    "speed": 1.5, "torque": 4, "energy": 5 * 65_536 + 6, "pressure": 1002, "is_open": True, "is_closed": False,
    "is_ready": True,
}  # fmt: skip


def on_line(lines: Lines, source: str, fields: Any = None, timeout_s: float = 2.0) -> tuple[KeptLine, Any]:
    """An open line, and a handler on it."""
    line, handler = lines.build(
        ModbusRegistersConfigurer, source, timeout_s=timeout_s, fields=FIELDS if fields is None else fields
    )
    with suppress(DeviceGone):
        line.open()
    return line, handler


def losses(handler: Any) -> dict[str, int]:
    return {str(reason): count for reason, count in fake_host(handler).losses.items()}


def test_all_fields_are_one_message_and_neighbours_are_one_request(
    lines: Lines, device: ModbusDevice, port: int
) -> None:
    _, handler = on_line(lines, f"tcp://127.0.0.1:{port}")
    (told,) = collect(handler, 1)
    assert told == TOLD
    assert device.asked == [(2, 4, 2), (3, 3, 5), (4, 2, 1)]


def test_rtu_over_a_serial_line_tells_the_same(lines: Lines, serial: ModbusDevice, cable: SerialCable) -> None:
    _, handler = on_line(lines, cable.port)
    (told,) = collect(handler, 1)
    assert told == TOLD


def test_rtu_frames_through_a_converter_tell_the_same(lines: Lines, port: int) -> None:
    made = tcp_device(port, FramerType.RTU)
    made.switch_on()
    _, handler = on_line(lines, f"rtu+tcp://127.0.0.1:{port}")
    assert collect(handler, 1) == [TOLD]
    made.switch_off()


def test_the_catalogue_has_units_and_types(lines: Lines, port: int) -> None:
    _, handler = on_line(lines, f"tcp://127.0.0.1:{port}")
    fields = message_type_of(type(handler)).model_json_schema()["properties"]
    assert fields["speed"]["unit"] == "m/s"
    kinds = {name: {one["type"] for one in its["anyOf"]} - {"null"} for name, its in fields.items()}
    assert (kinds["speed"], kinds["torque"], kinds["is_ready"]) == ({"number"}, {"integer"}, {"boolean"})


def test_what_the_device_refuses_is_null_counted_and_told_by_its_name(
    lines: Lines, device: ModbusDevice, port: int, caplog: pytest.LogCaptureFixture
) -> None:
    fields = {"torque": {"address": 4}, "nothing": {"address": 9999}}
    _, handler = on_line(lines, f"tcp://127.0.0.1:{port}", fields)
    assert collect(handler, 2) == [{"torque": 4, "nothing": None}] * 2
    assert losses(handler) == {"refused": 2}
    assert caplog.text.count("holding 9999: illegal data address (exception 2)") == 1


def test_a_device_that_refuses_everything_tells_nothing_and_is_no_lost_line(
    lines: Lines, device: ModbusDevice, port: int
) -> None:
    line, handler = on_line(lines, f"tcp://127.0.0.1:{port}", {"torque": {"address": 4}})
    device.says_no = ExcCodes.DEVICE_BUSY
    assert collect(handler, within_s=1.2) == []
    device.says_no = None
    assert collect(handler, 1) == [{"torque": 4}]
    assert line.keeper.absence is None


def test_a_server_that_is_away_for_thirty_seconds_is_gone_and_then_read_again(
    lines: Lines, device: ModbusDevice, port: int
) -> None:
    line, handler = on_line(lines, f"tcp://127.0.0.1:{port}")
    assert collect(handler, 1) == [TOLD]
    device.switch_off()
    with pytest.raises(DeviceGone, match="is lost"):
        collect(handler, 1)
    for _ in thirty_seconds(fake_host(handler).clock):
        with pytest.raises(DeviceGone, match="can't be opened"):
            line.open()
        with pytest.raises(DeviceGone, match="is lost"):
            collect(handler, 1)
    device.switch_on()
    line.open()
    assert collect(handler, 1) == [TOLD]


def test_an_answer_that_is_garbled_is_asked_for_again(lines: Lines, serial: ModbusDevice, cable: SerialCable) -> None:
    _, handler = on_line(lines, cable.port, {"torque": {"address": 4}}, 0.3)
    cable.noise = b"\xff\x00\x55" * 20
    assert collect(handler, 1) == [{"torque": 4}]


def test_a_serial_device_that_does_not_answer_is_gone_and_its_line_is_not(
    lines: Lines, serial: ModbusDevice, cable: SerialCable
) -> None:
    line, handler = on_line(lines, cable.port, {"torque": {"address": 4}}, 0.2)
    cable.is_cut = True
    with pytest.raises(DeviceGone, match="device 1 does not answer for holding 4"):
        collect(handler, 1)
    assert line.is_open
    cable.is_cut = False
    assert collect(handler, 1) == [{"torque": 4}]


async def test_an_operator_of_a_whole_robot_reads_it_and_reads_again_when_it_is_back(
    device: ModbusDevice, port: int
) -> None:
    params = {"line": {"source": f"tcp://127.0.0.1:{port}"}, "fields": FIELDS, "rate_hz": 50}
    async with joined(connector(ModbusRegistersConfigurer, label="drive", params=params)) as link:
        store = link.connection.receivable("drive")
        assert (await store.next_message()).json() == TOLD
        device.switch_off()
        device.holding[4] = 44
        device.switch_on()
        while (await store.next_message()).json()["torque"] != 44:
            pass  # what was read before


def test_two_connectors_that_describe_one_line_differently_are_told() -> None:
    shared = Shared()
    for baud in (9600, 19_200):
        params = {"line": {"source": "fake", "baud": baud}, "fields": {"a": {"address": 0}}}
        if baud == 9600:
            build(ModbusRegistersConfigurer, params=params, shared=shared)
        else:
            with pytest.raises(MosaicError, match="differently"):
                build(ModbusRegistersConfigurer, params=params, shared=shared)


@pytest.mark.parametrize("name", ["a b", "_x", "copy"])
def test_a_name_that_is_none_is_refused(name: str) -> None:
    with pytest.raises(ConfigError, match="name"):
        build(ModbusRegistersConfigurer, params={"fields": {name: {"address": 0}}})
