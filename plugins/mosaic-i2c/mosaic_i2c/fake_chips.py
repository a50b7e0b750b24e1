"""Chips that are made up: maps of registers that behave as the data sheets say, as far as anybody reads them.

They lie level and turn slowly to the left.
"""

from __future__ import annotations

import errno
import math
import os
import struct

STEP_RAD = 0.01
"""Between two readings."""


class FakeChip:
    """Registers of one chip, in up to four banks. Unplug it, and it does not answer."""

    def __init__(self) -> None:
        self.banks = [bytearray(256) for _ in range(4)]
        self.bank = 0
        self.is_plugged_in = True
        self.writes: list[tuple[int, int]] = []

    def read(self, register: int, count: int) -> bytes:
        self._answer()
        self.before_read(register)
        return bytes(self.banks[self.bank][register : register + count])

    def write(self, register: int, value: int) -> None:
        self._answer()
        self.writes.append((register, value))
        self.banks[self.bank][register] = value

    def before_read(self, register: int) -> None:
        """New values, if it has any."""

    def _answer(self) -> None:
        if not self.is_plugged_in:
            raise OSError(errno.EREMOTEIO, os.strerror(errno.EREMOTEIO))


class FakeBno055(FakeChip):
    """A BNO055: in a mode that fuses it turns, and is calibrated but for the compass."""

    def __init__(self) -> None:
        super().__init__()
        self.banks[0][0x00] = 0xA0
        self.yaw_rad = 0.0

    def before_read(self, register: int) -> None:
        if register != 0x08 or self.banks[0][0x3D] & 0x0F not in (0x08, 0x0C):
            return
        half = self.yaw_rad / 2
        self.banks[0][0x08:0x0E] = struct.pack("<3h", 0, 0, 981)
        self.banks[0][0x14:0x1A] = struct.pack("<3h", 0, 0, 450)
        self.banks[0][0x20:0x28] = struct.pack(
            "<4h", round(math.cos(half) * 16384), 0, 0, round(math.sin(half) * 16384)
        )
        self.banks[0][0x35] = 0b11_11_11_01
        self.yaw_rad += STEP_RAD


class FakeIcm20948(FakeChip):
    """An ICM-20948: asleep until it is woken; its settings lie in another bank than its values."""

    def __init__(self) -> None:
        super().__init__()
        self._reset()

    def _reset(self) -> None:
        self.banks = [bytearray(256) for _ in range(4)]
        self.banks[0][0x00], self.banks[0][0x06] = 0xEA, 0x41

    def write(self, register: int, value: int) -> None:
        super().write(register, value)
        if register == 0x7F:
            self.bank = value >> 4 & 3
        elif (self.bank, register) == (0, 0x06) and value & 0x80:
            self._reset()

    def before_read(self, register: int) -> None:
        if (self.bank, register) == (0, 0x2D) and not self.banks[0][0x06] & 0x40:
            per_g = 16384 >> (self.banks[2][0x14] >> 1 & 3)
            per_dps = 131.0 / (1 << (self.banks[2][0x01] >> 1 & 3))
            values = (0, 0, per_g, 0, 0, round(math.degrees(0.5) * per_dps))
            self.banks[0][0x2D:0x39] = struct.pack(">6h", *values)
