"""`mujoco-gripper-target`: opens and closes a gripper that one position actuator drives."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Self

from pydantic import Field, field_validator, model_validator
from pydantic_core.core_schema import ValidationInfo

from mosaic_core import DataChannelConfigurer, DataChannelReceivable, Delivery, FieldBounds, unit
from mosaic_core.messages import GripperTarget
from mosaic_mujoco.connectors.joint_target import TIMEOUT_S
from mosaic_mujoco.params import ActuatorName, MujocoParams
from mosaic_mujoco.world.facts import Span
from mosaic_mujoco.world.model_file import facts_of_file
from mosaic_mujoco.world.simulation import Simulation


class MujocoGripperTargetParams(MujocoParams):
    actuator: ActuatorName = Field(description="The position actuator that moves the fingers.")
    closed: float | None = Field(
        default=None,
        description="Its signal where the gripper is closed; none: the lower end of its range.",
        json_schema_extra=unit(""),
    )
    opened: float | None = Field(
        default=None,
        description="Its signal where the gripper is open; none: the upper end of its range.",
        json_schema_extra=unit(""),
    )
    opening_m: float | None = Field(
        default=None,
        gt=0,
        le=10,
        description="Between the fingers of the open gripper; none: as far as the signal goes, as one of a slide does.",
    )
    max_speed_mps: float = Field(default=0.1, gt=0, le=10, description="Fastest change of the opening.")

    @field_validator("actuator")
    @classmethod
    def _is_a_servo(cls, actuator: str, info: ValidationInfo) -> str:
        if (model := info.data.get("model")) is not None:
            facts = facts_of_file(model)
            servos = [one.name for one in facts.actuators if one.kind == "position"]
            facts.check_name("actuator", actuator, servos, "position actuator")
        return actuator

    @model_validator(mode="after")
    def _knows_both_ends(self) -> Self:
        span = self.span
        if span is None:
            raise ValueError(f"the actuator '{self.actuator}' has no ctrlrange: say `closed` and `opened`")
        if span.low == span.high:
            raise ValueError("`closed` and `opened` are the same")
        return self

    @property
    def span(self) -> Span | None:
        """From the signal that closes it to the one that opens it, which may be lower; ``None``: it is not said."""
        known = self.facts.actuator(self.actuator).range
        closed = self.closed if self.closed is not None else known.low if known else None
        opened = self.opened if self.opened is not None else known.high if known else None
        return None if closed is None or opened is None else Span(closed, opened)


class MujocoGripperTarget(DataChannelReceivable[GripperTarget]):
    """A gripper that goes as far as it is told. Made safe, it moves no further, and lets nothing go that it holds."""

    delivery = Delivery.LATEST
    requires_lease = True
    timeout_s = TIMEOUT_S

    def __init__(self, label: str, params: MujocoGripperTargetParams, simulation: Simulation, span: Span) -> None:
        super().__init__(label)
        self._simulation = simulation
        self._number = simulation.facts.actuator(params.actuator).id
        self._closed = span.low
        self._opening_m = params.opening_m or abs(span.high - span.low)
        self._signal_per_m = (span.high - span.low) / self._opening_m
        self._speed = params.max_speed_mps * abs(self._signal_per_m)
        self.limits: Mapping[str, FieldBounds] = {"position": FieldBounds(min=0.0, max=self._opening_m)}

    def handle_data(self, data: GripperTarget) -> None:
        self._simulation.press(self._number, data.max_effort)
        goal = self._closed + data.position * self._signal_per_m
        self._simulation.aim({self._number: goal}, {self._number: self._speed})

    def reported_position(self, field: str) -> float | None:
        """Fingers give way a little where they press: within what can be commanded."""
        opening_m = (float(self._simulation.moment.lengths[self._number]) - self._closed) / self._signal_per_m
        return Span(0.0, self._opening_m).clamped(opening_m)

    def make_safe(self, cause: str) -> None:
        self._simulation.hold([self._number], lets_go=False)


class MujocoGripperTargetConfigurer(DataChannelConfigurer[MujocoGripperTargetParams]):
    """Opens and closes the gripper of a MuJoCo model."""

    connector_type = "mujoco-gripper-target"
    example: ClassVar[dict[str, Any] | None] = {"model": "arm", "actuator": "gripper", "opening_m": 0.08}

    def configure(self) -> MujocoGripperTarget:
        span = self.params.span
        assert span is not None, "the params have been checked"
        return MujocoGripperTarget(self.label, self.params, self.params.simulation(self.shared).simulation, span)
