"""The world: the same seed and commands give the same story; in real time it follows the clock."""

import threading
import time

import pytest

from mosaic_core import Shared
from mosaic_sim.live_world import TICK_S, LiveWorld, shared_world
from mosaic_sim.world import RobotState, World


def story(seed: int) -> list[RobotState]:
    world, states = World(seed=seed), []
    for command in ((0.8, 0.0), (0.5, 1.0), (-0.4, 0.3), (0.0, 0.0)):
        world.drive(*command)
        world.advance(1.37)
        states.append(world.state)
    return states


def test_one_seed_tells_one_story() -> None:
    assert story(1) == story(1)


def test_time_in_small_or_large_portions_gives_the_same_world() -> None:
    one, many = World(), World()
    for world in (one, many):
        world.drive(0.7, 0.4)
    one.advance(1.0)
    for _ in range(400):
        many.advance(0.0025)
    assert one.state == many.state


def test_the_clock_stays_exact_over_hours() -> None:
    world = World()
    world.advance(360.0)
    assert world.state.time_s == pytest.approx(360.0, abs=1e-6)


def test_noise_depends_on_seed_and_sensor_only() -> None:
    draws = {(seed, name): World(seed=seed).noise(name).random() for seed in (1, 2) for name in ("imu", "scan")}
    assert len(set(draws.values())) == 4
    assert draws[1, "imu"] == World(seed=1).noise("imu").random()


def test_driving_drains_the_battery() -> None:
    parked, driven = World(), World()
    driven.drive(0.8, 0.0)
    for world in (parked, driven):
        world.advance(3.0)
    assert driven.state.battery.percent < parked.state.battery.percent < 92.0


def test_all_connectors_of_one_robot_share_the_world_of_their_seed() -> None:
    shared = Shared()
    assert shared_world(shared, 1) is shared_world(shared, 1)
    assert shared_world(shared, 1) is not shared_world(shared, 2)


def test_a_live_world_moves_between_enter_and_exit_only() -> None:
    live = LiveWorld(World())
    live.world.drive(0.5, 0.0)
    assert live.state.time_s == 0.0
    with live:
        deadline_s = time.monotonic() + 5
        while live.state.motion.travelled_m < 0.05 and time.monotonic() < deadline_s:
            threading.Event().wait(TICK_S)
    assert live.state.motion.travelled_m >= 0.05
    stopped = live.state
    assert live.world.command == (0.0, 0.0)
    assert live.state is stopped
