"""Velocity commands move a simulated vehicle: on wheels, along the world's axes, and no faster than its actuators."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from mosaic_cmdvel.cmd_vel import CmdVelConfigurer
from mosaic_core import ConfigError, Shared
from mosaic_core.messages import STANDSTILL, Twist
from mosaic_core.testing import build
from mosaic_mujoco.connectors.drive import MujocoDrive, MujocoDriveParams
from mosaic_mujoco.world.live_simulation import shared_simulation

if TYPE_CHECKING:
    from conftest import ModelWriter
    from mosaic_mujoco.world.simulation import Simulation

WHEELS = {
    "type": "mujoco", "model": "vehicle", "left": "left_wheel", "right": ["right_wheel"], "wheel_radius_m": 0.06,
    "track_width_m": 0.25,
}  # fmt: skip
PLANAR = """
<option gravity="0 0 0"/>
<worldbody><body name="base">
  <joint name="px" type="slide" axis="1 0 0"/><joint name="py" type="slide" axis="0 1 0"/>
  <joint name="pyaw" axis="0 0 1"/><geom size=".2"/>
</body></worldbody>
<actuator>
  <velocity name="x" joint="px" kv="2000"/><velocity name="y" joint="py" kv="2000"/>
  <velocity name="yaw" joint="pyaw" kv="200" ctrlrange="-1 1"/><motor name="horn" joint="px"/>
  <velocity name="loose" joint="px" gear="0"/>
</actuator>
"""


def drive(shared: Shared, **params: Any) -> MujocoDrive:
    return MujocoDrive(MujocoDriveParams.model_validate(params), shared)


def signals(simulation: Simulation) -> list[float]:
    """What the actuators were told last."""
    return list(simulation.look(lambda data: data.ctrl.tolist()))


def test_wheels_turn_as_fast_as_the_vehicle_shall_go_and_stand_when_it_is_told_to_stop(
    shared: Shared, vehicle: Simulation
) -> None:
    wheels = drive(shared, **WHEELS)
    wheels.apply(Twist.planar(0.6, yaw_radps=1.2))
    vehicle.advance(1)
    assert signals(vehicle) == pytest.approx([(0.6 - 0.15) / 0.06, (0.6 + 0.15) / 0.06])
    wheels.stop()
    vehicle.advance(1)
    assert signals(vehicle) == [0.0, 0.0]
    wheels.apply(Twist.planar(0.6))
    wheels.apply(STANDSTILL)
    vehicle.advance(1)
    assert signals(vehicle) == [0.0, 0.0]


def test_a_vehicle_that_is_told_to_go_too_fast_keeps_its_curve(shared: Shared, vehicle: Simulation) -> None:
    drive(shared, **WHEELS).apply(Twist.planar(3.0, yaw_radps=12.0))
    vehicle.advance(1)
    left, right = signals(vehicle)
    assert right == pytest.approx(25.0)
    assert left / right == pytest.approx((3.0 - 1.5) / (3.0 + 1.5))


def test_a_stop_overtakes_nothing_that_comes_later_and_a_reset_ends_what_was_commanded(
    shared: Shared, vehicle: Simulation
) -> None:
    wheels = drive(shared, **WHEELS)
    wheels.apply(Twist.planar(0.6))
    vehicle.reset("home")
    vehicle.advance(1)
    assert signals(vehicle) == [0.0, 0.0]


def test_a_base_on_the_worlds_axes_goes_ahead_wherever_it_looks(written: ModelWriter, shared: Shared) -> None:
    model = written(PLANAR)
    simulation = shared_simulation(shared, model).simulation
    base = drive(shared, type="mujoco", model=model, x="x", y="y", yaw="yaw", heading="pyaw")
    base.apply(Twist.planar(yaw_radps=9.0))  # as its ctrlrange allows: 1 rad/s
    simulation.advance(785)
    base.apply(Twist.planar(1.0))
    simulation.advance(500)
    x, y, yaw = simulation.look(lambda data: data.qpos.tolist())
    assert yaw == pytest.approx(1.57, abs=0.05)
    assert (x, y) == (pytest.approx(0.0, abs=0.06), pytest.approx(1.0, abs=0.06))


def test_a_base_without_a_heading_pushes_along_its_own_axes(written: ModelWriter, shared: Shared) -> None:
    model = written(PLANAR)
    simulation = shared_simulation(shared, model).simulation
    drive(shared, type="mujoco", model=model, y="y").apply(Twist.planar(1.0, 0.5))
    simulation.advance(1)
    assert signals(simulation) == [0.0, 0.5, 0.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"left": ["left_weel"]}, "did you mean 'left_wheel'"),
        ({"right": []}, "wheels on one side alone"),
        ({"left": [], "right": []}, "either `left` and `right`, or some of"),
        ({"x": "left_wheel"}, "either `left` and `right`, or some of"),
        ({"track_width_m": None}, "wheels need `wheel_radius_m` and `track_width_m`"),
        ({"model": "nowhere.xml"}, "there is no such file"),
    ],
)
def test_what_a_vehicle_lacks_is_told_before_anything_starts(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigError) as told:
        build(CmdVelConfigurer, params={"drive": {**WHEELS, **changes}})
    assert words in str(told.value)


def test_an_actuator_of_another_kind_and_a_heading_that_is_no_hinge_are_told(written: ModelWriter) -> None:
    model = written(PLANAR)
    with pytest.raises(ConfigError, match="no velocity actuator 'horn'"):
        build(CmdVelConfigurer, params={"drive": {"type": "mujoco", "model": model, "x": "horn"}})
    with pytest.raises(ConfigError, match="no velocity actuator 'loose'"):
        build(CmdVelConfigurer, params={"drive": {"type": "mujoco", "model": model, "x": "loose"}})
    with pytest.raises(ConfigError, match="no hinge 'px'"):
        build(CmdVelConfigurer, params={"drive": {"type": "mujoco", "model": model, "x": "x", "heading": "px"}})
