"""The registers of a series of servos: where each quantity stands and how it is spelt."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from mosaic_arm.servos.bus import MotorReading
from mosaic_arm.servos.packets import ServoReply


def _signed(size_bytes: int) -> tuple[Callable[[int], int], Callable[[int], int]]:
    whole = 1 << 8 * size_bytes
    return lambda value: value % whole, lambda raw: raw - whole if raw >= whole // 2 else raw


@dataclass(frozen=True, slots=True)
class Register:
    """A number in a motor. Without ``to_raw`` and ``from_raw`` it is two's complement."""

    address: int
    size_bytes: int
    to_raw: Callable[[int], int] | None = None
    from_raw: Callable[[int], int] | None = None

    def spelt(self, value: int) -> bytes:
        """Raises :class:`OverflowError` for what does not fit."""
        to_raw = self.to_raw or _signed(self.size_bytes)[0]
        return to_raw(value).to_bytes(self.size_bytes, "little")

    def value(self, data: bytes) -> int:
        from_raw = self.from_raw or _signed(self.size_bytes)[1]
        return from_raw(int.from_bytes(data[: self.size_bytes], "little"))


def _none(raw: int) -> tuple[str, ...]:
    return ()


@dataclass(frozen=True, slots=True)
class ServoRegisters:
    """What the arm reads and writes. ``torque_full``: the torque limit that is all a motor has; ``lock``: 0 there lets
    offset and range be written; ``faults``: where an alert is explained."""

    torque: Register
    goal: Register
    torque_limit: Register
    torque_full: int
    present: Register
    reading: Callable[[ServoReply], MotorReading]
    offset: Register
    range_min: Register
    range_max: Register
    lock: Register | None = None
    faults: Register | None = None
    faults_of: Callable[[int], tuple[str, ...]] = _none
