"""`mujoco-joint-target`: moves the joints of a model that position actuators drive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

from pydantic import Field, field_validator
from pydantic_core.core_schema import ValidationInfo

from mosaic_core import DataChannelConfigurer, DataChannelReceivable, Delivery, FieldBounds
from mosaic_core.messages import JointTarget
from mosaic_mujoco.params import JointNames, MujocoParams
from mosaic_mujoco.world.facts import ActuatorFact, JointFact, Span
from mosaic_mujoco.world.model_file import facts_of_file
from mosaic_mujoco.world.simulation import Simulation

TIMEOUT_S = 0.3
"""Silence after which it stays, as a real arm does. A page says its target again until the joint is there."""


class MujocoJointTargetParams(MujocoParams):
    joints: JointNames = Field(
        default=(), description="Which may be moved; none: all that a position actuator drives by itself."
    )
    max_speed_radps: float = Field(default=1.0, gt=0, le=100, description="Fastest turn of a hinge.")
    max_speed_mps: float = Field(default=0.2, gt=0, le=100, description="Fastest move of a slide.")

    @field_validator("joints")
    @classmethod
    def _have_servos(cls, joints: tuple[str, ...], info: ValidationInfo) -> tuple[str, ...]:
        if (model := info.data.get("model")) is not None:
            facts = facts_of_file(model)
            for name in joints:
                facts.check_name("joint", name, list(facts.servos()), "joint with a position actuator")
        return joints


class MujocoJointTarget(DataChannelReceivable[JointTarget]):
    """Each joint goes where it shall, no faster than it may; made safe, it stays where it is."""

    delivery = Delivery.LATEST
    requires_lease = True
    timeout_s = TIMEOUT_S

    def __init__(self, label: str, params: MujocoJointTargetParams, simulation: Simulation) -> None:
        super().__init__(label)
        self._simulation = simulation
        facts = simulation.facts
        servos = facts.servos()
        self._servos = {name: servos[name] for name in params.joints or servos}
        self._numbers = [one.id for one in self._servos.values()]
        joints = {name: facts.joint(name) for name in self._servos}
        self._speeds = {
            name: params.max_speed_mps if joint.kind == "slide" else params.max_speed_radps
            for name, joint in joints.items()
        }
        self.item_names: Sequence[str] = tuple(self._servos)
        spans = {name: reach(joints[name], servo) for name, servo in self._servos.items()}
        self.limits: Mapping[str, FieldBounds] = {
            f"positions.{name}": FieldBounds(min=span.low, max=span.high) for name, span in spans.items() if span
        }

    def handle_data(self, data: JointTarget) -> None:
        goals, speeds = {}, {}
        for name, position in zip(data.names, data.positions, strict=True):
            servo = self._servos[name]
            goals[servo.id] = position * servo.gear
            speeds[servo.id] = self._speed(servo, name, goals[servo.id], data.duration_s)
        self._simulation.aim(goals, speeds)

    def _speed(self, servo: ActuatorFact, name: str, goal: float, duration_s: float | None) -> float:
        """In units of the actuator's signal per second."""
        fastest = self._speeds[name] * abs(servo.gear)
        if duration_s is None:
            return fastest
        return min(fastest, abs(goal - self._simulation.setpoint(servo.id)) / duration_s)

    def reported_position(self, field: str) -> float | None:
        servo = self._servos.get(field.removeprefix("positions."))
        return None if servo is None else float(self._simulation.moment.lengths[servo.id]) / servo.gear

    def make_safe(self, cause: str) -> None:
        self._simulation.hold(self._numbers)


def reach(joint: JointFact, servo: ActuatorFact) -> Span | None:
    """How far a joint can be sent: as far as the signal of its servo goes, and the joint itself."""
    if servo.range is None:
        return joint.range
    ends = sorted((servo.range.low / servo.gear, servo.range.high / servo.gear))
    return Span(ends[0], ends[1]).within(joint.range)


class MujocoJointTargetConfigurer(DataChannelConfigurer[MujocoJointTargetParams]):
    """Moves the joints of a MuJoCo model that position actuators drive."""

    connector_type = "mujoco-joint-target"
    example: ClassVar[dict[str, Any] | None] = {"model": "arm", "joints": ["base_yaw", "shoulder", "elbow"]}

    def configure(self) -> MujocoJointTarget:
        return MujocoJointTarget(self.label, self.params, self.params.simulation(self.shared).simulation)
