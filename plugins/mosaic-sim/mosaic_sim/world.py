"""The simulated world: one robot in one room, advanced in fixed steps. Pure: no clock, no thread; the same seed and
the same commands always give the same world."""

from __future__ import annotations

import zlib
from dataclasses import dataclass, field, replace

import numpy as np

from mosaic_sim.motion import Chassis, Motion, moved
from mosaic_sim.power import Battery, drained, speed_limit_mps
from mosaic_sim.room import COURTYARD_START, Room, courtyard

STEP_S = 0.01
"""Fixed: at full speed 12 mm, far less than the robot's radius, so that it can't tunnel through a wall."""


@dataclass(frozen=True, slots=True)
class RobotState:
    """Everything true about the robot at one moment."""

    time_s: float = 0.0
    motion: Motion = field(default_factory=Motion)
    battery: Battery = field(default_factory=Battery)


class World:
    """A room, a robot, and the command that drives it.

    ``state`` is replaced whole at each step and ``command`` is set whole, so that any thread may read and command
    while one thread advances.
    """

    def __init__(
        self,
        room: Room | None = None,
        *,
        seed: int = 1,
        start: tuple[float, float, float] = COURTYARD_START,
        chassis: Chassis | None = None,
    ) -> None:
        self.seed = seed
        self.room = room or courtyard(seed)
        self.chassis = chassis or Chassis()
        self.state = RobotState(motion=Motion(*start))
        self._command = (0.0, 0.0)
        self._steps = 0
        self._owed_s = 0.0

    @property
    def command(self) -> tuple[float, float]:
        """Linear m/s and angular rad/s."""
        return self._command

    def drive(self, linear_mps: float, angular_radps: float) -> None:
        """What the wheels shall do from the next step on. Any thread."""
        self._command = (float(linear_mps), float(angular_radps))

    def advance(self, duration_s: float) -> None:
        """Let time pass: as many whole steps as fit; the rest is kept for the next call. One thread at a time."""
        self._owed_s += duration_s
        while self._owed_s >= STEP_S - 1e-9:
            self._owed_s -= STEP_S
            self._step()

    def noise(self, name: str) -> np.random.Generator:
        """A random source for one sensor: its sequence depends on the seed and the name, not on other sensors."""
        return np.random.default_rng([self.seed, zlib.crc32(name.encode())])

    def _step(self) -> None:
        before = self.state
        limit_mps = speed_limit_mps(before.battery)
        linear, angular = self._command
        command = (min(limit_mps, max(-limit_mps, linear)), angular)
        motion = moved(self.room, self.chassis, before.motion, command, STEP_S)
        battery = drained(
            before.battery,
            speed_mps=motion.linear_mps,
            turn_radps=motion.angular_radps,
            acceleration_mps2=motion.linear_mps2,
            is_docked=self.room.is_docked(motion.x_m, motion.y_m),
            dt_s=STEP_S,
        )
        self._steps += 1
        # Counted, not summed: after hours the clock is still exact.
        self.state = replace(before, time_s=self._steps * STEP_S, motion=motion, battery=battery)
