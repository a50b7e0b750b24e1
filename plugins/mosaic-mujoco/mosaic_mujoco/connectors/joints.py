"""`mujoco-joints`: how the joints of a model stand."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

import numpy as np
from pydantic import Field, field_validator
from pydantic_core.core_schema import ValidationInfo

from mosaic_core import DataChannelConfigurer, DataChannelSendable, Delivery
from mosaic_core.messages import JointState, wall_time_us
from mosaic_mujoco.params import JointNames, PeriodicParams
from mosaic_mujoco.world.model_file import facts_of_file
from mosaic_mujoco.world.simulation import Simulation

DIGITS = 4


class MujocoJointsParams(PeriodicParams):
    joints: JointNames = Field(default=(), description="Which hinges and slides; none: all that have a name.")

    @field_validator("joints")
    @classmethod
    def _have_one_number(cls, joints: tuple[str, ...], info: ValidationInfo) -> tuple[str, ...]:
        if (model := info.data.get("model")) is not None:
            turning = [one.name for one in facts_of_file(model).turning()]
            for name in joints:
                facts_of_file(model).check_name("joint", name, turning, "hinge or slide")
        return joints


class MujocoJoints(DataChannelSendable[JointState]):
    delivery = Delivery.LATEST

    def __init__(self, label: str, params: MujocoJointsParams, simulation: Simulation) -> None:
        super().__init__(label)
        self._period_s = params.period_s
        self._simulation = simulation
        turning = simulation.facts.turning()
        chosen = [one for one in turning if not params.joints or one.name in params.joints]
        self._names = [one.name for one in chosen]
        self._positions_at = [one.position_at for one in chosen]
        self._velocities_at = [one.velocity_at for one in chosen]

    def messages(self) -> Iterator[JointState]:
        for _ in self.every(self._period_s):
            positions, velocities, efforts = self._simulation.look(self._read)
            yield JointState(
                names=self._names,
                positions=positions,
                velocities=velocities,
                efforts=efforts,
                timestamp=wall_time_us(),
            )

    def _read(self, data: Any) -> tuple[list[float], list[float], list[float]]:
        positions = data.qpos[self._positions_at]
        velocities, efforts = data.qvel[self._velocities_at], data.qfrc_actuator[self._velocities_at]
        rounded = [np.round(values, DIGITS).tolist() for values in (positions, velocities, efforts)]
        return rounded[0], rounded[1], rounded[2]


class MujocoJointsConfigurer(DataChannelConfigurer[MujocoJointsParams]):
    """How the joints of a MuJoCo model stand."""

    connector_type = "mujoco-joints"
    example: ClassVar[dict[str, Any] | None] = {"model": "arm"}

    def configure(self) -> MujocoJoints:
        return MujocoJoints(self.label, self.params, self.params.simulation(self.shared).simulation)
