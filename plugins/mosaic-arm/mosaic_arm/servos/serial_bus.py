"""A bus of real servos on a serial line, of either protocol."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Self

from mosaic_arm.calibration import MotorCalibration
from mosaic_arm.servos.bus import MotorReading
from mosaic_arm.servos.packets import PING, read_block, read_one, write_block, write_one
from mosaic_arm.servos.registers import Register, ServoRegisters
from mosaic_arm.servos.serial_line import SerialLine
from mosaic_core import DeviceGone

PING_TRIES = 2
"""A first byte after power-up may be lost; a motor that misses two is missing."""


class SerialBus:
    """Speaks with real motors over a line, as a ``ServoBus``."""

    def __init__(self, line: SerialLine, registers: ServoRegisters, motors: Sequence[int]) -> None:
        self._line = line
        self._form = line.form
        self._registers = registers
        self._motors = tuple(motors)

    def __enter__(self) -> Self:
        self._line.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        self._line.__exit__()

    def missing(self) -> list[int]:
        return [motor for motor in self._motors if not self._answers(motor)]

    def _answers(self, motor: int) -> bool:
        packet, data_bytes = self._form.instruction(motor, PING), 3 if self._form.address_size == 2 else 0
        return any(self._line.ask(packet, [motor], data_bytes) for _ in range(PING_TRIES))

    def read(self) -> dict[int, MotorReading]:
        block, registers = self._registers.present, self._registers
        packet = read_block(self._form, self._motors, block.address, block.size_bytes)
        replies = self._line.ask(packet, self._motors, block.size_bytes)
        return {motor: self._explained(motor, registers.reading(reply)) for motor, reply in replies.items()}

    def _explained(self, motor: int, reading: MotorReading) -> MotorReading:
        """Where a motor only says that something is wrong with it, ask what."""
        if not reading.faults or self._registers.faults is None:
            return reading
        raw = self._value(motor, self._registers.faults)
        return reading if raw is None else replace(reading, faults=self._registers.faults_of(raw) or ("alert",))

    def write_goals(self, ticks: Mapping[int, int]) -> None:
        self._write({motor: self._registers.goal.spelt(value) for motor, value in ticks.items()}, self._registers.goal)

    def set_torque(self, motors: Sequence[int], *, on: bool) -> None:
        register = self._registers.torque
        self._write({motor: register.spelt(int(on)) for motor in motors}, register)

    def limit_torque(self, percent: Mapping[int, float]) -> None:
        register, full = self._registers.torque_limit, self._registers.torque_full
        self._write({motor: register.spelt(round(full * share / 100)) for motor, share in percent.items()}, register)

    def _write(self, data: Mapping[int, bytes], register: Register) -> None:
        if data:
            self._line.say(write_block(self._form, register.address, data))

    def homing_offsets(self) -> dict[int, int]:
        found = {motor: self._value(motor, self._registers.offset) for motor in self._motors}
        return {motor: value for motor, value in found.items() if value is not None}

    def _value(self, motor: int, register: Register) -> int | None:
        packet = read_one(self._form, motor, register.address, register.size_bytes)
        reply = self._line.ask(packet, [motor], register.size_bytes).get(motor)
        return None if reply is None else register.value(reply.data)

    def store_calibration(self, joints: Sequence[MotorCalibration]) -> None:
        for joint in joints:
            self._store(joint.id, self._registers.lock, 0)
            self._store(joint.id, self._registers.offset, joint.homing_offset)
            self._store(joint.id, self._registers.range_min, joint.range_min)
            self._store(joint.id, self._registers.range_max, joint.range_max)
            self._store(joint.id, self._registers.lock, 1)

    def _store(self, motor: int, register: Register | None, value: int) -> None:
        if register is None:
            return
        packet = write_one(self._form, motor, register.address, register.spelt(value))
        if motor not in self._line.ask(packet, [motor]):
            raise DeviceGone(f"motor {motor} on {self._line.port} did not take its calibration", "Try again.")
