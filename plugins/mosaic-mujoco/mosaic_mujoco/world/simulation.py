"""The simulation: a model, its state, and what its actuators are told. No clock and no thread: the same commands at the
same steps always give the same story.

Any thread may call it. ``_stepping`` is held for one step or one look, ``_telling`` for some microseconds: whoever
makes it safe waits for no physics.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from mosaic_mujoco.world.engine import engine
from mosaic_mujoco.world.model_file import compiled
from mosaic_mujoco.world.reading import facts_of
from mosaic_mujoco.world.setpoints import Setpoints, Signals

_log = logging.getLogger(__name__)

T = TypeVar("T")
Steering = Callable[[Any], Mapping[int, float]]
"""Gets MuJoCo's data before each step, gives signals by the number of the actuator."""

LAG = 0.1
"""rad or m. A joint that is further than that from where it was sent has been held up, and stays where it is."""


@dataclass(frozen=True, slots=True)
class SimulatedMoment:
    """When the simulation is, and where its actuators are, in the units of their signals."""

    time_s: float
    steps: int
    lengths: Signals


class Simulation:
    """A model that moves on step by step. ``path``: its file; raises :class:`ModelUnreadable`."""

    def __init__(self, path: Path) -> None:
        self.model = compiled(path)
        self.facts = facts_of(self.model, path.stem)
        self.unstable = 0
        """How often the numbers grew beyond all bounds, and it began anew."""
        self._data = engine().MjData(self.model)
        self._stepping = threading.Lock()
        self._telling = threading.Lock()
        self._setpoints = Setpoints(self.model.nu)
        self._steerings: dict[str, Steering] = {}
        self._forces = self.model.actuator_forcerange.copy(), self.model.actuator_forcelimited.copy()
        self._steps = 0
        keys = self.facts.keys
        self.start_key: str | None = "home" if "home" in keys else keys[0] if keys else None
        """Where it begins; ``None``: where the model stands by itself."""
        self.moment = SimulatedMoment(0.0, 0, np.zeros(self.model.nu))
        self.reset(self.start_key)

    @property
    def timestep_s(self) -> float:
        return self.facts.timestep_s

    # -- time -----------------------------------------------------------------------------------------------------

    def advance(self, steps: int) -> None:
        """So many steps. One thread at a time."""
        for _ in range(steps):
            with self._stepping:
                self._step()

    def _step(self) -> None:
        data, before_s = self._data, self._data.time
        with self._telling:
            data.ctrl[:] = self._setpoints.advance(self.timestep_s)
            steerings = list(self._steerings.values())
        for steering in steerings:
            for number, signal in steering(data).items():
                data.ctrl[number] = signal
        engine().mj_step(self.model, data)
        self._steps += 1
        if data.time <= before_s:  # MuJoCo begins anew by itself
            self._told_unstable()
        self._note_moment()

    def _told_unstable(self) -> None:
        self.unstable += 1
        level = logging.ERROR if self.unstable == 1 else logging.DEBUG
        _log.log(level, "%s: the simulation became unstable and began anew; try a smaller timestep", self.facts.name)
        self._begin(self.start_key)

    def _note_moment(self) -> None:
        self.moment = SimulatedMoment(float(self._data.time), self._steps, self._data.actuator_length.copy())

    # -- looking --------------------------------------------------------------------------------------------------

    def look(self, at: Callable[[Any], T]) -> T:
        """What ``at`` makes of MuJoCo's data between two steps; it must be quick, and change nothing."""
        with self._stepping:
            return at(self._data)

    # -- commands -------------------------------------------------------------------------------------------------

    def aim(self, goals: Mapping[int, float], speeds: Mapping[int, float] | None = None) -> None:
        """Let actuators go there, by their numbers, no faster than ``speeds`` (units of the signal per second)."""
        with self._telling:
            self._setpoints.aim(goals, speeds)

    def steer(self, key: str, steering: Steering | None) -> None:
        """Ask ``steering`` before each step, until another one comes for ``key``; a reset ends it."""
        with self._telling:
            if steering is None:
                self._steerings.pop(key, None)
            else:
                self._steerings[key] = steering

    def hold(self, numbers: Collection[int], *, lets_go: bool = True) -> None:
        """Let actuators stay. One that has been held up on its way stays where it is, unless it shall not let go."""
        lengths = self.moment.lengths
        with self._telling:
            self._setpoints.stay(numbers)
            if lets_go:
                held_up = [one for one in numbers if abs(lengths[one] - self._setpoints.now[one]) > LAG]
                self._setpoints.aim({one: float(lengths[one]) for one in held_up})

    def setpoint(self, number: int) -> float:
        """What an actuator is told now."""
        with self._telling:
            return float(self._setpoints.now[number])

    def press(self, number: int, most: float | None) -> None:
        """Bound the force of an actuator; ``None``: as the model has it."""
        ranges, limited = self._forces
        with self._stepping:
            if most is None:
                self.model.actuator_forcerange[number] = ranges[number]
                self.model.actuator_forcelimited[number] = limited[number]
            else:
                low, high = (-most, most) if not limited[number] else ranges[number]
                self.model.actuator_forcerange[number] = max(low, -most), min(high, most)
                self.model.actuator_forcelimited[number] = 1

    # -- beginning anew -------------------------------------------------------------------------------------------

    def reset(self, key: str | None = None) -> None:
        """Begin anew at a key frame, or where the model stands by itself. Whatever was commanded before is over, and
        everything stays where it then is. Raises :class:`ValueError` for a key frame that there is not."""
        if key is not None:
            self.facts.check_name("key frame", key)
        with self._stepping:
            self._begin(key)

    def _begin(self, key: str | None) -> None:
        mujoco, data = engine(), self._data
        ranges, limited = self._forces
        self.model.actuator_forcerange[:], self.model.actuator_forcelimited[:] = ranges, limited
        number = -1 if key is None else mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_KEY.value, key)
        if number < 0:
            mujoco.mj_resetData(self.model, data)
        else:
            mujoco.mj_resetDataKeyframe(self.model, data, number)
        mujoco.mj_forward(self.model, data)
        with self._telling:
            self._steerings.clear()
            self._setpoints.settle(self._at_rest())
            data.ctrl[:] = self._setpoints.now
        mujoco.mj_forward(self.model, data)
        self._note_moment()

    def _at_rest(self) -> Signals:
        """What keeps everything where it is: the key frame's own signals if it has any, else of each servo where it
        stands and of all others 0."""
        data = self._data
        if np.any(data.ctrl):
            return np.array(data.ctrl)
        signals = np.zeros(self.model.nu)
        for one in self.facts.actuators:
            if one.kind == "position":
                at = float(data.actuator_length[one.id])
                signals[one.id] = one.range.clamped(at) if one.range else at
        return signals
