"""The world in real time: a thread that advances it while the robot runs. One world per robot and seed."""

from __future__ import annotations

import time

from pydantic import Field

from mosaic_core import Keeper, Params, Shared
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
        self._last_s = 0.0
        self._keeper = Keeper("mosaic-sim-world", self._advance)

    @property
    def state(self) -> RobotState:
        """The robot now. Any thread."""
        return self.world.state

    def __enter__(self) -> LiveWorld:
        self._last_s = time.monotonic()
        self._keeper.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.world.drive(0.0, 0.0)
        self._keeper.stop()

    def _advance(self) -> float:
        now_s = time.monotonic()
        self.world.advance(min(now_s - self._last_s, MAX_CATCH_UP_S))
        self._last_s = now_s
        return TICK_S


def shared_world(shared: Shared, seed: int) -> LiveWorld:
    """The robot's one world of this seed; whoever asks first makes it."""
    return shared.get(f"mosaic-sim:world:{seed}", lambda: LiveWorld(World(seed=seed)))
