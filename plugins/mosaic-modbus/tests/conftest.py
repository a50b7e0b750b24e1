"""Devices on TCP and on a serial line."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from support.devices.modbus_device import Lines, ModbusDevice, SerialCable, serial_device, tcp_device
from support.processes import free_port


@pytest.fixture
def port() -> int:
    return free_port()


@pytest.fixture
def lines() -> Iterator[Lines]:
    """Lines without threads, which are closed when the test is over."""
    made = Lines()
    yield made
    made.close()


@pytest.fixture
def device(port: int) -> Iterator[ModbusDevice]:
    """A device on TCP, switched on."""
    made = tcp_device(port)
    made.switch_on()
    yield made
    made.switch_off()


@pytest.fixture
def cable() -> Iterator[SerialCable]:
    made = SerialCable()
    yield made
    made.close()


@pytest.fixture
def serial(cable: SerialCable) -> Iterator[ModbusDevice]:
    """A device at the end of the cable, switched on."""
    made = serial_device(cable)
    made.switch_on()
    yield made
    made.switch_off()
