"""Drive ``mujoco`` of `cmd-vel`: velocity actuators of a model move a vehicle, by its wheels or along its axes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from mosaic_cmdvel import Drive, DriveParams
from mosaic_cmdvel.kinematics import DifferentialBase, saturated
from mosaic_core.contract.devices.shared import Shared
from mosaic_core.messages import STANDSTILL, Twist
from mosaic_mujoco.params import ActuatorName, ActuatorNames, JointName
from mosaic_mujoco.world.facts import ActuatorFact
from mosaic_mujoco.world.live_simulation import shared_simulation
from mosaic_mujoco.world.model_file import facts_of_file


class MujocoDriveParams(DriveParams):
    """Either ``left`` and ``right``, or any of ``x``, ``y`` and ``yaw``."""

    type: Literal["mujoco"]
    model: str = Field(description="Path of the model, or `vehicle`, which comes with this package.")
    left: ActuatorNames = Field(default=(), description="Velocity actuators of the wheels on the left side.")
    right: ActuatorNames = Field(default=(), description="Those on the right side.")
    wheel_radius_m: float | None = Field(default=None, gt=0, le=5, description="Radius of the wheels.")
    track_width_m: float | None = Field(default=None, gt=0, le=20, description="Between the wheels of both sides.")
    x: ActuatorName | None = Field(default=None, description="Velocity actuator that pushes forward, in m/s.")
    y: ActuatorName | None = Field(default=None, description="Velocity actuator that pushes to the left, in m/s.")
    yaw: ActuatorName | None = Field(default=None, description="Velocity actuator that turns to the left, in rad/s.")
    heading: JointName | None = Field(
        default=None,
        description="The hinge that turns the vehicle, where `x` and `y` push along the world's axes; none: they push "
        "along its own.",
    )

    @field_validator("model")
    @classmethod
    def _can_be_read(cls, model: str) -> str:
        facts_of_file(model)
        return model

    @field_validator("left", "right", mode="before")
    @classmethod
    def _one_is_a_list(cls, names: Any) -> Any:
        return (names,) if isinstance(names, str) else names

    @model_validator(mode="after")
    def _is_one_kind_of_vehicle(self) -> Self:
        is_planar = any((self.x, self.y, self.yaw))
        if is_planar == bool(self.left or self.right):
            raise ValueError("it needs either `left` and `right`, or some of `x`, `y` and `yaw`")
        if not is_planar and not (self.left and self.right):
            raise ValueError("wheels on one side alone: say `left` and `right`")
        if not is_planar and (self.wheel_radius_m is None or self.track_width_m is None):
            raise ValueError("wheels need `wheel_radius_m` and `track_width_m`")
        self._check_kinds()
        return self

    def _check_kinds(self) -> None:
        facts = facts_of_file(self.model)
        velocity = [one.name for one in facts.actuators if one.kind == "velocity" and one.gear]
        for name in (*self.left, *self.right, *filter(None, (self.x, self.y, self.yaw))):
            facts.check_name("actuator", name, velocity, "velocity actuator")
        if self.heading is not None:
            hinges = [one.name for one in facts.joints if one.kind == "hinge"]
            facts.check_name("joint", self.heading, hinges, "hinge")


class MujocoDrive(Drive[MujocoDriveParams]):
    """Tells the velocity actuators how fast to turn or push; an actuator with a ``ctrlrange`` is told no more than
    that, and the curve stays."""

    def __init__(self, params: MujocoDriveParams, shared: Shared) -> None:
        super().__init__(params, shared)
        self._simulation = shared_simulation(shared, params.model).simulation
        facts = self._simulation.facts
        self._left = [facts.actuator(name) for name in params.left]
        self._right = [facts.actuator(name) for name in params.right]
        self._axes = {part: facts.actuator(name) for part in ("x", "y", "yaw") if (name := getattr(params, part))}
        self._heading_at = facts.joint(params.heading).position_at if params.heading else None
        driven = (*self._left, *self._right, *self._axes.values())
        self._still = {one.id: 0.0 for one in driven}
        self._key = f"drive:{sorted(self._still)}"

    def apply(self, twist: Twist) -> None:
        if twist == STANDSTILL:
            self.stop()
        elif self._axes:
            self._simulation.steer(self._key, lambda data: self._pushed(data, twist))
        else:
            signals = self._rolled(twist)
            self._simulation.steer(self._key, lambda data: signals)

    def stop(self) -> None:
        self._simulation.steer(self._key, None)
        self._simulation.aim(self._still)

    def _rolled(self, twist: Twist) -> Mapping[int, float]:
        params = self.params
        assert params.wheel_radius_m is not None, "the params have been checked"
        assert params.track_width_m is not None, "the params have been checked"
        wheels = DifferentialBase(params.wheel_radius_m, params.track_width_m).wheels(twist)
        fastest = [fastest_radps(one) for one in (*self._left, *self._right)]
        wheels = saturated(wheels, min(fastest))
        left = {one.id: wheels.left_radps * one.gear for one in self._left}
        return left | {one.id: wheels.right_radps * one.gear for one in self._right}

    def _pushed(self, data: Any, twist: Twist) -> Mapping[int, float]:
        """Turned into the world's axes before each step, as the vehicle turns on."""
        yaw_rad = 0.0 if self._heading_at is None else float(data.qpos[self._heading_at])
        cos, sin = math.cos(yaw_rad), math.sin(yaw_rad)
        velocities = {
            "x": cos * twist.linear.x - sin * twist.linear.y,
            "y": sin * twist.linear.x + cos * twist.linear.y,
            "yaw": twist.angular.z,
        }
        signals = {one.id: velocities[part] * one.gear for part, one in self._axes.items()}
        return {one.id: _clamped(one, signals[one.id]) for one in self._axes.values()}


def fastest_radps(wheel: ActuatorFact) -> float:
    """As its ``ctrlrange`` allows in both directions."""
    if wheel.range is None:
        return math.inf
    return max(0.0, min(-wheel.range.low, wheel.range.high)) / abs(wheel.gear)


def _clamped(actuator: ActuatorFact, signal: float) -> float:
    return actuator.range.clamped(signal) if actuator.range else signal
