"""A bus that is made up: motors that follow their goals as first-order systems, to be tried on any machine."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Self

from mosaic_arm.calibration import TICKS_PER_TURN, MotorCalibration
from mosaic_arm.servos.bus import MotorReading

TIME_CONSTANT_S = 0.06
"""After so much time two thirds of the way to a goal are done: a small servo with a light arm."""
MAX_TICKS_PER_S = 3000.0
"""Four and a half radians a second, as an STS3215 turns at 7.4 V."""
FALLS_TICKS_PER_S = 150.0
"""Without torque each joint sinks towards the end of its range so fast, as if somebody let it down."""
MAX_STEP_S = 0.5
ROOM_C = 30.0


class SimulatedBus:
    """Plays motors, as a ``ServoBus``. It moves when it is read, by the time that has passed on ``clock``."""

    def __init__(self, joints: Sequence[MotorCalibration], clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._joints = {one.id: one for one in joints}
        self._ticks = {one.id: (one.range_min + one.range_max) / 2 for one in joints}
        self._goals = dict(self._ticks)
        self._speeds = dict.fromkeys(self._ticks, 0.0)
        self._powered: set[int] = set()
        self._limits = dict.fromkeys(self._ticks, 100.0)
        self._read_at_s = clock()

    def __enter__(self) -> Self:
        self._read_at_s = self._clock()
        return self

    def __exit__(self, *_: object) -> None:
        """It stays where it is."""

    def missing(self) -> list[int]:
        return []

    def read(self) -> dict[int, MotorReading]:
        now_s = self._clock()
        step_s, self._read_at_s = min(max(0.0, now_s - self._read_at_s), MAX_STEP_S), now_s
        for motor in self._ticks:
            self._move(motor, step_s)
        return {motor: self._reading(motor) for motor in self._ticks}

    def _move(self, motor: int, step_s: float) -> None:
        before, joint = self._ticks[motor], self._joints[motor]
        if motor in self._powered:
            way = (self._goals[motor] - before) * (1 - math.exp(-step_s / TIME_CONSTANT_S))
            most = MAX_TICKS_PER_S * step_s
            after = before + min(max(way, -most), most)
        else:
            after = before - FALLS_TICKS_PER_S * step_s
        self._ticks[motor] = min(max(after, joint.range_min), joint.range_max)
        self._speeds[motor] = (self._ticks[motor] - before) / step_s if step_s else 0.0

    def _reading(self, motor: int) -> MotorReading:
        load = min(100.0, abs(self._goals[motor] - self._ticks[motor]) / TICKS_PER_TURN * 400)
        on = motor in self._powered
        return MotorReading(
            ticks=round(self._ticks[motor]),
            ticks_per_s=self._speeds[motor],
            load_percent=min(load, self._limits[motor]) if on else 0.0,
            voltage_v=7.4,
            temperature_c=ROOM_C + (2.0 if on else 0.0),
        )

    def write_goals(self, ticks: Mapping[int, int]) -> None:
        self._goals.update({motor: float(value) for motor, value in ticks.items()})

    def set_torque(self, motors: Sequence[int], *, on: bool) -> None:
        self._powered = self._powered | set(motors) if on else self._powered - set(motors)

    def limit_torque(self, percent: Mapping[int, float]) -> None:
        self._limits.update(percent)

    def homing_offsets(self) -> dict[int, int]:
        return {motor: joint.homing_offset for motor, joint in self._joints.items()}

    def store_calibration(self, joints: Sequence[MotorCalibration]) -> None:
        self._joints.update({one.id: one for one in joints})
