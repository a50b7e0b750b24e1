"""Reads and writes registers of chips on an I²C bus of Linux, or of chips that are made up."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Protocol

from smbus2 import SMBus

from mosaic_core.words.errors import DeviceGone

FAKE = "fake"
"""The bus that is made up, to try a connector without one."""


class Chip(Protocol):
    """One chip on its bus. Both raise :class:`OSError` when it does not answer."""

    def read(self, register: int, count: int) -> bytes:
        """``count`` registers from ``register`` on, at most 32."""
        ...

    def write(self, register: int, value: int) -> None:
        """Set one register."""
        ...


class BusChip:
    """The chip at ``address`` of an open bus."""

    def __init__(self, bus: SMBus, address: int) -> None:
        self._bus = bus
        self._address = address

    def read(self, register: int, count: int) -> bytes:
        return bytes(self._bus.read_i2c_block_data(self._address, register, count))

    def write(self, register: int, value: int) -> None:
        self._bus.write_byte_data(self._address, register, value)


@contextmanager
def opened(source: str, address: int, fake: Callable[[], Chip]) -> Iterator[Chip]:
    """The chip at ``address`` of the bus ``source``. Whatever fails with :class:`OSError` in the block is
    :class:`DeviceGone`: a chip that does not answer, a bus that is not there."""
    try:
        if source == FAKE:
            yield fake()
            return
        with SMBus(source) as bus:
            yield BusChip(bus, address)
    except OSError as error:
        cure = "is it wired, and is I²C switched on?"
        raise DeviceGone(f"{source}, address {address:#04x}: {error.strerror or error}", cure) from error
