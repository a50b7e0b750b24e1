"""Devices on TCP and on a serial line."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from support.modbus_device import ModbusDevice, SerialCable, free_port, serial_device, tcp_device


@pytest.fixture
def port() -> int:
    return free_port()


@pytest.fixture
def device(port: int) -> Iterator[ModbusDevice]:
    """A device on TCP, switched on."""
    made = tcp_device(port)
    made.switch_on()
    yield made
    made.switch_off()


@pytest.fixture
def cable(tmp_path: Path) -> Iterator[SerialCable]:
    made = SerialCable(tmp_path / "ttyUSB0")
    yield made
    made.close()


@pytest.fixture
def serial(cable: SerialCable) -> Iterator[ModbusDevice]:
    """A device at the end of the cable, switched on."""
    made = serial_device(cable)
    made.switch_on()
    yield made
    made.switch_off()
