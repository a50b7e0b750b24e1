"""The world in real time: a thread that advances it while the robot runs. One world per robot and seed."""

from __future__ import annotations

import threading
import time

from pydantic import Field

from mosaic_core import Params, Shared
from mosaic_sim.world import RobotState, World

TICK_S = 0.02
MAX_CATCH_UP_S = 0.25
"""After a stall (a suspended laptop) the world goes on from where it was instead of racing through the gap."""


class SimParams(Params):
    """Params that every part of the simulated robot takes."""

    seed: int = Field(default=1, ge=0, description="Connectors and drives of one seed share one world.")


class LiveWorld:
    """A :class:`World` that a thread of its own keeps in step with the monotonic clock between enter and exit.

    Not entered, it stands still: tests advance :attr:`world` themselves.
    """

    def __init__(self, world: World) -> None:
        self.world = world
        self._stopping = threading.Event()
        self._thread: threading.Thread | None = None

    @property
    def state(self) -> RobotState:
        """The robot now. Any thread."""
        return self.world.state

    def __enter__(self) -> LiveWorld:
        self._stopping.clear()
        self._thread = threading.Thread(target=self._keep_in_step, name="mosaic-sim-world", daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopping.set()
        self.world.drive(0.0, 0.0)
        if self._thread is not None:
            self._thread.join(timeout=1.0)
            self._thread = None

    def _keep_in_step(self) -> None:
        last_s = time.monotonic()
        while not self._stopping.wait(TICK_S):
            now_s = time.monotonic()
            self.world.advance(min(now_s - last_s, MAX_CATCH_UP_S))
            last_s = now_s


def shared_world(shared: Shared, seed: int) -> LiveWorld:
    """The robot's one world of this seed; whoever asks first makes it."""
    return shared.get(f"mosaic-sim:world:{seed}", lambda: LiveWorld(World(seed=seed)))
