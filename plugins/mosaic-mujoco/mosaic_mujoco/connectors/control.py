"""`mujoco-control`: pauses the simulation, takes single steps, lets it run faster or slower."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from mosaic_core import DataChannelConfigurer, Message, Request, RequestHandler, unit
from mosaic_mujoco.params import MujocoParams
from mosaic_mujoco.world.live_simulation import CHUNK_STEPS, LiveSimulation

MAX_STEPS = 10_000

SimulationSpeed = Annotated[float, Field(gt=0, le=1000)] | Literal["max"]


class SimulationOrder(Message):
    """What is left out stays as it is."""

    pause: bool | None = Field(default=None, description="Stand still, or go on.")
    speed: SimulationSpeed | None = Field(
        default=None,
        description="Seconds that are simulated per second; `max`: as fast as it goes.",
        json_schema_extra=unit(""),
    )
    steps: int = Field(default=0, ge=0, le=MAX_STEPS, description="So many steps at once, also while it is paused.")


class SimulationState(Message):
    time_s: float = Field(description="Simulated time.", json_schema_extra=unit("s"))
    steps: int = Field(description="Since the robot started.")
    is_paused: bool
    speed: float | None = Field(description="none: as fast as it goes.", json_schema_extra=unit(""))
    left_out_s: float = Field(
        description="Simulated time that fell out, because the machine was too slow.", json_schema_extra=unit("s")
    )
    unstable: int = Field(description="How often it became unstable and began anew.")


class MujocoControlParams(MujocoParams):
    speed: SimulationSpeed = Field(
        default=1.0,
        description="How fast it runs from the start: seconds that are simulated per second; `max`: as fast as it "
        "goes.",
        json_schema_extra=unit(""),
    )
    paused: bool = Field(default=False, description="Stand still from the start.")


class MujocoControl(RequestHandler[SimulationOrder, SimulationState]):
    requires_lease = True
    at_once: ClassVar[int] = 1

    def __init__(self, label: str, live: LiveSimulation) -> None:
        super().__init__(label)
        self._live = live

    def answer(self, question: SimulationOrder, request: Request) -> SimulationState:
        if question.pause is not None:
            self._live.pause(question.pause)
        if question.speed is not None:
            self._live.run_at(None if question.speed == "max" else question.speed)
        left = question.steps
        while left > 0 and not request.is_cancelled:
            self._live.step(min(left, CHUNK_STEPS))
            left -= CHUNK_STEPS
        now = self._live.report
        return SimulationState(
            time_s=now.time_s,
            steps=now.steps,
            is_paused=now.is_paused,
            speed=now.speed,
            left_out_s=now.left_out_s,
            unstable=now.unstable,
        )


class MujocoControlConfigurer(DataChannelConfigurer[MujocoControlParams]):
    """Pauses a MuJoCo simulation, steps it, and says how fast it runs."""

    connector_type = "mujoco-control"
    example: ClassVar[dict[str, Any] | None] = {"model": "arm"}

    def configure(self) -> MujocoControl:
        live = self.params.simulation(self.shared)
        live.run_at(None if self.params.speed == "max" else self.params.speed)
        live.pause(self.params.paused)
        return MujocoControl(self.label, live)
