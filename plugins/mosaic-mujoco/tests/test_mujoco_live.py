"""The simulation beside the clock, and a whole robot on it with an operator in Python."""

from __future__ import annotations

import json
import logging
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from mosaic_core import Shared
from mosaic_core.testing import WebRtcNetwork, connector, joined
from mosaic_mujoco.connectors.camera import MujocoCameraConfigurer
from mosaic_mujoco.connectors.control import MujocoControlConfigurer
from mosaic_mujoco.connectors.joint_target import MujocoJointTargetConfigurer
from mosaic_mujoco.connectors.joints import MujocoJointsConfigurer
from mosaic_mujoco.connectors.reset import MujocoResetConfigurer
from mosaic_mujoco.world.engine import engine
from mosaic_mujoco.world.live_simulation import LiveSimulation, shared_simulation
from mosaic_mujoco.world.model_file import model_path
from mosaic_mujoco.world.simulation import Simulation

IN_TIME_S = 20.0
ARM = {"model": "arm"}


class Watched(Simulation):
    """Says when a number of steps is reached."""

    def __init__(self) -> None:
        super().__init__(model_path("vehicle"))
        self._reached = threading.Condition()

    def advance(self, steps: int) -> None:
        super().advance(steps)
        with self._reached:
            self._reached.notify_all()

    def wait_for(self, condition: Callable[[], bool]) -> bool:
        with self._reached:
            return self._reached.wait_for(condition, IN_TIME_S)


@pytest.fixture
def live() -> Iterator[LiveSimulation]:
    made = LiveSimulation(Watched())
    yield made
    made.__exit__(None, None, None)


def reaches(live: LiveSimulation, steps: int) -> bool:
    simulation = live.simulation
    assert isinstance(simulation, Watched)
    return simulation.wait_for(lambda: simulation.moment.steps >= steps)


def test_it_moves_on_by_itself_between_enter_and_exit(live: LiveSimulation) -> None:
    assert live.report.steps == 0
    with live:
        assert reaches(live, 20)
    steps = live.report.steps
    with live:  # a robot that starts again
        assert reaches(live, steps + 20)


def test_as_fast_as_it_goes_it_leaves_nothing_out(live: LiveSimulation) -> None:
    live.run_at(None)
    with live:
        assert reaches(live, 5000)  # 20 s of the vehicle's
    assert live.report.speed is None
    assert live.report.left_out_s == 0.0


def test_paused_it_takes_only_the_steps_that_it_is_told_to(live: LiveSimulation) -> None:
    live.pause(True)
    with live:
        live.step(7)
        live.step(3)
        assert live.report.steps == 10
        live.pause(False)
        assert reaches(live, 30)


def test_a_machine_that_is_too_slow_is_told_of_once_and_what_is_left_out_is_counted(
    live: LiveSimulation, caplog: pytest.LogCaptureFixture
) -> None:
    live.run_at(1000.0)  # no machine is as fast
    simulation = live.simulation
    assert isinstance(simulation, Watched)
    with caplog.at_level(logging.WARNING), live:
        assert simulation.wait_for(lambda: live.report.left_out_s > 100.0)
    assert [record.levelname for record in caplog.records] == ["WARNING"]
    assert "falls behind the clock" in caplog.text


def test_an_engine_that_gives_up_is_told_with_its_reason_and_tried_again_at_the_next_start(
    live: LiveSimulation, caplog: pytest.LogCaptureFixture
) -> None:
    has_given_up = threading.Event()

    def give_up(data: Any) -> dict[int, float]:
        has_given_up.set()
        raise engine().FatalError('out of memory\n(increase <size memory="..."/>)')

    live.simulation.steer("test", give_up)
    with live:
        assert has_given_up.wait(IN_TIME_S)
    assert live.report.failure == 'out of memory (increase <size memory="..."/>)'
    assert "stands still until the robot starts anew" in caplog.text
    live.simulation.steer("test", None)
    with live:
        assert reaches(live, 20)
        assert live.report.failure == ""


def test_connectors_of_one_model_share_one_simulation(shared: Shared) -> None:
    first = shared_simulation(shared, "arm")
    assert shared_simulation(shared, "arm") is first
    assert shared_simulation(shared, str(model_path("arm"))) is first
    assert shared_simulation(shared, "vehicle") is not first


async def elbow_comes_to(joints: Any, place: float) -> None:
    while True:
        state = json.loads((await joints.next_message(IN_TIME_S)).data)
        if abs(state["positions"][0] - place) < 0.02:
            return


@pytest.mark.webrtc
@pytest.mark.usefixtures("draws")
async def test_an_operator_sees_the_arm_moves_it_and_puts_it_back() -> None:
    with WebRtcNetwork() as network:
        async with joined(
            connector(MujocoControlConfigurer, label="simulation", params={**ARM, "speed": 4.0}),
            connector(MujocoJointTargetConfigurer, label="arm", params=ARM),
            connector(MujocoJointsConfigurer, label="joints", params={**ARM, "joints": ["elbow"]}),
            connector(MujocoCameraConfigurer, label="overview", params={**ARM, "width": 64, "height": 48}),
            connector(MujocoResetConfigurer, label="reset", params=ARM),
            takes_leases=True,
            network=network,
        ) as link:
            connection = link.connection
            picture = await connection.media("overview").next_image(IN_TIME_S)
            assert picture.std() > 10
            arm, joints = connection.sendable("arm"), connection.receivable("joints")
            await arm.wait_open(IN_TIME_S)
            assert arm.send_json({"names": ["elbow"], "positions": [1.0]})
            await elbow_comes_to(joints, 1.0)
            answer = await connection.request("reset", {})
            assert answer["key"] == "home"
            await elbow_comes_to(joints, 1.6)
            await connection.request("simulation", {"pause": True})
