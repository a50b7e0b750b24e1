"""`mujoco-health`: whether the simulation keeps pace with the clock, and whether it is stable."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar, Literal

from pydantic import Field

from mosaic_core import DataChannelConfigurer, DataChannelSendable, Delivery
from mosaic_core.messages import Diagnostic, wall_time_us
from mosaic_mujoco.params import MujocoParams
from mosaic_mujoco.world.live_simulation import LiveSimulation, PaceReport

Level = Literal["ok", "warn", "error"]


class MujocoHealthParams(MujocoParams):
    period_s: float = Field(default=1.0, gt=0, le=60, description="Seconds between two messages.")


class MujocoHealth(DataChannelSendable[Diagnostic]):
    delivery = Delivery.LATEST

    def __init__(self, label: str, params: MujocoHealthParams, live: LiveSimulation) -> None:
        super().__init__(label)
        self._period_s = params.period_s
        self._live = live

    def messages(self) -> Iterator[Diagnostic]:
        before, before_s = self._live.report, self.monotonic_s()
        for _ in self.every(self._period_s):
            now, now_s = self._live.report, self.monotonic_s()
            yield diagnosed(self._live.simulation.facts.name, before, now, now_s - before_s)
            before, before_s = now, now_s


def diagnosed(name: str, before: PaceReport, now: PaceReport, passed_s: float) -> Diagnostic:
    """What is to be told of a simulation after ``passed_s`` more seconds."""
    level, message = _judged(before, now)
    values = {
        "simulated": f"{now.time_s:.1f} s",
        "steps": str(now.steps),
        "speed": "as fast as it goes" if now.speed is None else f"{now.speed:g}",
        "left out": f"{now.left_out_s:.1f} s",
        "unstable": f"{now.unstable} times",
    }
    if passed_s > 0 and now.time_s >= before.time_s:
        values["reached"] = f"{(now.time_s - before.time_s) / passed_s:.2f}"
    return Diagnostic(level=level, name=name, message=message, values=values, timestamp=wall_time_us())


def _judged(before: PaceReport, now: PaceReport) -> tuple[Level, str]:
    if now.failure:
        return "error", f"stands still: {now.failure}"
    if now.unstable > before.unstable:
        return "error", "became unstable and began anew"
    if now.left_out_s > before.left_out_s:
        return "warn", "falls behind the clock"
    return "ok", "paused" if now.is_paused else "runs"


class MujocoHealthConfigurer(DataChannelConfigurer[MujocoHealthParams]):
    """Whether a MuJoCo simulation keeps pace and is stable."""

    connector_type = "mujoco-health"
    example: ClassVar[dict[str, Any] | None] = {"model": "arm"}

    def configure(self) -> MujocoHealth:
        return MujocoHealth(self.label, self.params, self.params.simulation(self.shared))
