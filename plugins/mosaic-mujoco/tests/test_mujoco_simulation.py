"""The simulation: the same commands at the same steps give the same story; made safe it stays; it begins anew."""

from __future__ import annotations

import gc
import logging
import resource
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from mosaic_mujoco.world.model_file import model_path
from mosaic_mujoco.world.simulation import Simulation

if TYPE_CHECKING:
    from conftest import ModelWriter

ELBOW = 2
PENDULUM = """
<worldbody><body><joint name="swing" axis="0 1 0"/><geom size=".05" pos="0 0 -.5"/></body></worldbody>
<actuator><position name="servo" joint="swing" kp="{kp}" kv="1"/></actuator>
"""


def place(simulation: Simulation) -> list[float]:
    return list(simulation.look(lambda data: data.qpos.tolist()))


def joint_angles(simulation: Simulation, *names: str) -> dict[str, float]:
    """Where joints are now."""
    joints = [simulation.facts.joint(name) for name in names]
    return simulation.look(lambda data: {one.name: float(data.qpos[one.position_at]) for one in joints})


def story(steps: int) -> list[float]:
    simulation = Simulation(model_path("arm"))
    simulation.aim({0: 1.0, 1: -0.4}, {0: 1.0, 1: 0.5})
    simulation.advance(steps)
    simulation.hold([0, 1])
    simulation.advance(steps)
    return place(simulation)


def test_the_same_commands_at_the_same_steps_give_the_same_story() -> None:
    assert story(150) == story(150)


def test_it_begins_at_home_and_stays_there(arm: Simulation) -> None:
    before = place(arm)
    arm.advance(500)
    assert place(arm) == pytest.approx(before, abs=2e-3)
    assert arm.moment.time_s == pytest.approx(1.0)


def test_a_servo_goes_where_it_shall_at_its_speed(arm: Simulation) -> None:
    began = joint_angles(arm, "elbow")["elbow"]
    arm.aim({ELBOW: began - 0.5}, {ELBOW: 1.0})
    arm.advance(100)  # 0.2 s
    assert joint_angles(arm, "elbow")["elbow"] == pytest.approx(began - 0.2, abs=0.1)  # a servo lags
    arm.advance(400)
    assert joint_angles(arm, "elbow")["elbow"] == pytest.approx(began - 0.5, abs=0.01)


def test_held_it_stays_where_it_is_however_often_it_is_told(arm: Simulation) -> None:
    arm.aim({ELBOW: 0.2}, {ELBOW: 1.0})
    arm.advance(200)
    arm.hold([ELBOW])
    arm.advance(400)
    at = joint_angles(arm, "elbow")["elbow"]
    for _ in range(50):
        arm.hold([ELBOW])
        arm.advance(10)
    assert joint_angles(arm, "elbow")["elbow"] == pytest.approx(at, abs=1e-3)


def test_a_joint_that_was_held_up_gives_in_when_it_is_made_safe_and_a_gripper_does_not(written: ModelWriter) -> None:
    weak = Simulation(model_path(written(PENDULUM.format(kp=0.5))))  # gravity is stronger
    weak.aim({0: 1.5})
    weak.advance(2000)
    reached = joint_angles(weak, "swing")["swing"]
    assert reached < 1.0
    weak.hold([0], lets_go=False)
    weak.advance(1)
    assert weak.setpoint(0) == 1.5
    weak.hold([0])
    weak.advance(1)
    assert weak.setpoint(0) == pytest.approx(reached, abs=0.01)


def test_after_a_reset_everything_is_where_it_began_and_nothing_moves_on(vehicle: Simulation) -> None:
    before = place(vehicle)
    vehicle.steer("drive", lambda data: {0: 10.0, 1: 10.0})
    vehicle.advance(300)
    assert place(vehicle)[7] > before[7] + 0.3
    vehicle.reset("home")
    assert place(vehicle) == before
    vehicle.advance(300)
    assert place(vehicle) == pytest.approx(before, abs=0.02)


def test_a_key_frame_that_there_is_not_is_told_and_changes_nothing(arm: Simulation) -> None:
    before = place(arm)
    with pytest.raises(ValueError, match="no key frame 'hoem'; did you mean 'home'"):
        arm.reset("hoem")
    assert place(arm) == before


def test_a_key_frame_without_signals_is_held_by_the_servos(arm: Simulation) -> None:
    arm.reset("upright")
    arm.advance(300)
    angles = joint_angles(arm, "shoulder", "elbow", "wrist_pitch")
    assert list(angles.values()) == pytest.approx([0.0, 0.0, 0.0], abs=0.01)


def test_a_force_is_bounded_until_the_next_reset(arm: Simulation) -> None:
    before = arm.model.actuator_forcerange[6].tolist()
    arm.press(6, 4.0)
    assert arm.model.actuator_forcerange[6].tolist() == [-4.0, 4.0]
    arm.press(6, 400.0)
    assert arm.model.actuator_forcerange[6].tolist() == before  # no harder than by itself
    arm.press(6, 4.0)
    arm.reset("home")
    assert arm.model.actuator_forcerange[6].tolist() == before


def test_an_unstable_simulation_begins_anew_and_says_so_once(
    written: ModelWriter, caplog: pytest.LogCaptureFixture
) -> None:
    wild = "<option timestep='0.05' integrator='Euler'/>" + PENDULUM.format(kp=1e7)
    simulation = Simulation(model_path(written(wild)))
    with caplog.at_level(logging.WARNING):
        for _ in range(3):
            simulation.aim({0: 3.0})
            simulation.advance(200)
    assert simulation.unstable > 1
    assert np.isfinite(place(simulation)).all()
    assert [record.message for record in caplog.records].count(caplog.records[0].message) == len(caplog.records) == 1


def test_a_thousand_resets_need_no_more_memory() -> None:
    simulation = Simulation(model_path("arm"))

    def reset_often(times: int) -> int:
        for _ in range(times):
            simulation.reset("home")
            simulation.advance(1)
        gc.collect()
        resident_pages = int(Path("/proc/self/statm").read_text().split()[1])
        return resident_pages * resource.getpagesize() // 1024

    before_kib = reset_often(200)
    assert reset_often(1000) - before_kib < 2048
