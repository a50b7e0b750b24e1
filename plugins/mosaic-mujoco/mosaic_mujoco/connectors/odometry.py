"""`mujoco-odometry`: where a body of the model is, and how it moves; exactly, as no wheel's odometry is."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from mosaic_core import DataChannelConfigurer, DataChannelSendable, Delivery
from mosaic_core.messages import AngularVelocity, LinearVelocity, Odometry, Point, Twist, wall_time_us
from mosaic_mujoco.connectors.sensor import quaternion
from mosaic_mujoco.params import BodyName, PeriodicParams
from mosaic_mujoco.world.engine import engine
from mosaic_mujoco.world.facts import MANY, ModelFacts
from mosaic_mujoco.world.simulation import Simulation

Numbers = NDArray[np.float64]


class MujocoOdometryParams(PeriodicParams):
    body: BodyName | None = Field(
        default=None, description="Whose; none: of the one that floats freely and carries actuators, if it is one."
    )

    @model_validator(mode="after")
    def _knows_its_body(self) -> Self:
        if self.body is None and base_of(self.facts) is None:
            some = ", ".join(self.facts.bodies[:MANY])
            raise ValueError(f"which body of the model {self.facts.name}? Say `body`; it has {some}")
        return self


def base_of(facts: ModelFacts) -> str | None:
    """The body that is the robot's: the only floating one, or the only one of them that carries driven joints."""
    floating = [one.body for one in facts.joints if one.kind == "free" and one.body]
    if len(floating) == 1:
        return floating[0]
    driven = {one.joint for one in facts.actuators if one.joint}
    carrying = [body for body in floating if driven & set(facts.carried_by(body))]
    return carrying[0] if len(carrying) == 1 else None


class MujocoOdometry(DataChannelSendable[Odometry]):
    delivery = Delivery.LATEST

    def __init__(self, label: str, params: MujocoOdometryParams, simulation: Simulation, body: str) -> None:
        super().__init__(label)
        self._period_s = params.period_s
        self._simulation = simulation
        mujoco = engine()
        self._body = mujoco.mj_name2id(simulation.model, mujoco.mjtObj.mjOBJ_BODY.value, body)

    def messages(self) -> Iterator[Odometry]:
        for _ in self.every(self._period_s):
            place, attitude, velocity = self._simulation.look(self._read)
            turn, move = velocity[:3], velocity[3:]
            yield Odometry(
                position=Point(x=place[0], y=place[1], z=place[2]),
                orientation=quaternion(attitude),
                twist=Twist(
                    linear=LinearVelocity(x=move[0], y=move[1], z=move[2]),
                    angular=AngularVelocity(x=turn[0], y=turn[1], z=turn[2]),
                ),
                timestamp=wall_time_us(),
            )

    def _read(self, data: Any) -> tuple[Numbers, Numbers, Numbers]:
        """Its velocity is in its own frame, first the rotation."""
        mujoco, velocity = engine(), np.zeros(6)
        kind = mujoco.mjtObj.mjOBJ_XBODY.value
        mujoco.mj_objectVelocity(self._simulation.model, data, kind, self._body, velocity, 1)
        return data.xpos[self._body].copy(), data.xquat[self._body].copy(), velocity


class MujocoOdometryConfigurer(DataChannelConfigurer[MujocoOdometryParams]):
    """Where a body of a MuJoCo model is, and how it moves."""

    connector_type = "mujoco-odometry"
    example: ClassVar[dict[str, Any] | None] = {"model": "vehicle", "body": "chassis"}

    def configure(self) -> MujocoOdometry:
        simulation = self.params.simulation(self.shared).simulation
        body = self.params.body or base_of(simulation.facts)
        assert body is not None, "the params have been checked"
        return MujocoOdometry(self.label, self.params, simulation, body)
