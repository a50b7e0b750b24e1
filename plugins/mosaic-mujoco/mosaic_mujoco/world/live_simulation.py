"""The simulation in real time, or as fast as it goes: a thread that advances it while the robot runs. There is one for
each robot and model; all connectors that name the model share it."""

from __future__ import annotations

import logging
import threading
import time
from dataclasses import dataclass
from pathlib import Path

from mosaic_core import Keeper, Shared
from mosaic_mujoco.world.engine import engine
from mosaic_mujoco.world.model_file import model_path
from mosaic_mujoco.world.pace import StepPace
from mosaic_mujoco.world.simulation import Simulation

_log = logging.getLogger(__name__)

TICK_S = 0.004
"""Between two looks at the clock."""
SLICE_S = 0.02
"""As fast as it goes: so long without a rest; then the others of this process get their turn for :data:`REST_S`."""
REST_S = 0.002
CHUNK_STEPS = 20
"""Between two looks at whether it shall end."""
TOLD_AGAIN_S = 5.0
"""It has kept pace for so long: it is told that it does again."""
END_PATIENCE_S = 2.0


@dataclass(frozen=True, slots=True)
class PaceReport:
    """How the simulation keeps pace. ``speed``: ``None``: as fast as it goes. ``failure``: why the engine gave up;
    empty: it works."""

    time_s: float
    steps: int
    is_paused: bool
    speed: float | None
    left_out_s: float
    unstable: int
    failure: str = ""


class LiveSimulation:
    """A :class:`Simulation` that a thread of its own advances between enter and exit. Not entered, it stands still:
    tests advance :attr:`simulation` themselves."""

    def __init__(self, simulation: Simulation) -> None:
        self.simulation = simulation
        self._pace = StepPace(simulation.timestep_s)
        self._is_paused = False
        self._turn = threading.Lock()
        """Held by whoever advances it: the thread, or a single step."""
        self._last_s = 0.0
        self._keeper = Keeper(f"mujoco-{simulation.facts.name}", self._advance, patience_s=END_PATIENCE_S)
        self._behind_since_s: float | None = None
        self._failure = ""

    # -- any thread -----------------------------------------------------------------------------------------------

    @property
    def report(self) -> PaceReport:
        moment = self.simulation.moment
        return PaceReport(
            moment.time_s, moment.steps, self._is_paused, self._pace.speed, self._pace.left_out_s,
            self.simulation.unstable, self._failure,
        )  # fmt: skip

    def pause(self, is_paused: bool) -> None:
        """Stand still, or go on; a pause in between is not caught up."""
        with self._turn:
            self._is_paused = is_paused
            self._pace.forget()

    def run_at(self, speed: float | None) -> None:
        """Seconds that are simulated per second; ``None``: as fast as it goes."""
        with self._turn:
            self._pace.speed = speed
            self._pace.forget()

    def step(self, steps: int) -> None:
        """So many steps now, also while it is paused."""
        with self._turn:
            self.simulation.advance(steps)

    # -- its thread -----------------------------------------------------------------------------------------------

    def __enter__(self) -> LiveSimulation:
        self._failure, self._last_s = "", time.monotonic()
        self._keeper.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._keeper.stop()

    def _advance(self) -> float | None:
        """Go on to now, and return the seconds to rest."""
        now_s = time.monotonic()
        try:
            with self._turn:
                if not self._is_paused and self._pace.speed is None:
                    self._race(now_s + SLICE_S)
                elif not self._is_paused:
                    self._keep_pace(now_s, now_s - self._last_s)
        except engine().FatalError as error:  # such as contacts for which the model's memory is too small
            self._failure = " ".join(str(error).split())
            name = self.simulation.facts.name
            _log.error("%s: MuJoCo gave up, the simulation stands still until the robot starts anew: %s", name, error)
            return None
        self._last_s = now_s
        return REST_S if self._pace.speed is None else TICK_S

    def _race(self, until_s: float) -> None:
        while time.monotonic() < until_s and not self._keeper.is_stopping:
            self.simulation.advance(1)

    def _keep_pace(self, now_s: float, passed_s: float) -> None:
        left_out_s = self._pace.left_out_s
        steps = self._pace.due(passed_s)
        while steps > 0 and not self._keeper.is_stopping:
            self.simulation.advance(min(steps, CHUNK_STEPS))
            steps -= CHUNK_STEPS
        self._tell_change(now_s, self._pace.left_out_s > left_out_s)

    def _tell_change(self, now_s: float, is_behind: bool) -> None:
        """Once when it falls behind, once when it has kept pace again for a while."""
        name = self.simulation.facts.name
        if is_behind:
            if self._behind_since_s is None:
                _log.warning("%s: this machine is too slow for the simulation; it falls behind the clock", name)
            self._behind_since_s = now_s
        elif self._behind_since_s is not None and now_s - self._behind_since_s > TOLD_AGAIN_S:
            _log.warning("%s: the simulation keeps pace again; left out: %.1f s", name, self._pace.left_out_s)
            self._behind_since_s = None


def shared_simulation(shared: Shared, model: str) -> LiveSimulation:
    """The robot's one simulation of ``model``; whoever asks first makes it. Raises :class:`ModelUnreadable`."""
    path: Path = model_path(model)
    return shared.get(f"mosaic-mujoco:{path.resolve()}", lambda: LiveSimulation(Simulation(path)))
