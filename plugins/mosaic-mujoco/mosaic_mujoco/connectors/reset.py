"""`mujoco-reset`: begins the simulation anew when it is asked to."""

from __future__ import annotations

from typing import Any, ClassVar

from pydantic import Field

from mosaic_core import DataChannelConfigurer, Message, Refused, Request, RequestHandler, unit
from mosaic_mujoco.params import MujocoParams
from mosaic_mujoco.world.simulation import Simulation


class ResetOrder(Message):
    key: str | None = Field(default=None, max_length=128, description="A key frame of the model; none: where it began.")


class ResetDone(Message):
    key: str | None = Field(description="Where it begins; none: where the model stands by itself.")
    time_s: float = Field(description="Simulated time.", json_schema_extra=unit("s"))


class MujocoReset(RequestHandler[ResetOrder, ResetDone]):
    """Whatever moves is told to stay first: the wheels stand, and each servo keeps the place that the key frame has."""

    requires_lease = True

    def __init__(self, label: str, simulation: Simulation) -> None:
        super().__init__(label)
        self._simulation = simulation

    def answer(self, question: ResetOrder, request: Request) -> ResetDone:
        key = question.key if question.key is not None else self._simulation.start_key
        try:
            self._simulation.reset(key)
        except ValueError as error:
            raise Refused("channel.invalid", str(error)) from error
        return ResetDone(key=key, time_s=self._simulation.moment.time_s)


class MujocoResetConfigurer(DataChannelConfigurer[MujocoParams]):
    """Begins a MuJoCo simulation anew, at a key frame by name."""

    connector_type = "mujoco-reset"
    example: ClassVar[dict[str, Any] | None] = {"model": "arm"}

    def configure(self) -> MujocoReset:
        return MujocoReset(self.label, self.params.simulation(self.shared).simulation)
