"""`sim-health`: how the parts of the simulated robot are: its battery, its bumper, its motors."""

from __future__ import annotations

from collections.abc import Iterator

from pydantic import Field

from mosaic_core import DataChannelConfigurer, DataChannelSendable
from mosaic_core.messages import Diagnostic, wall_time_us
from mosaic_sim.live_world import LiveWorld, SimParams, shared_world
from mosaic_sim.world import RobotState

LOW_PERCENT, EMPTY_PERCENT = 30.0, 10.0


class SimHealthParams(SimParams):
    period_s: float = Field(default=1.0, gt=0, le=60, description="Seconds between two messages of each part.")


class SimHealth(DataChannelSendable[Diagnostic]):
    def __init__(self, label: str, params: SimHealthParams, world: LiveWorld) -> None:
        super().__init__(label)
        self._params = params
        self._world = world

    def messages(self) -> Iterator[Diagnostic]:
        for _ in self.every(self._params.period_s):
            yield from reports(self._world.state)


def reports(state: RobotState) -> Iterator[Diagnostic]:
    """One of each part."""
    now_us = wall_time_us()
    percent, motion = state.battery.percent, state.motion
    level = "error" if percent < EMPTY_PERCENT else "warn" if percent < LOW_PERCENT else "ok"
    words = "charging" if state.battery.is_charging else "" if level == "ok" else "low: drive to the green pad"
    charge = {"charge": f"{percent:.1f} %", "voltage": f"{state.battery.voltage_v:.2f} V"}
    yield Diagnostic.model_validate(
        {"level": level, "name": "battery", "message": words, "values": charge, "timestamp": now_us}
    )
    touches = motion.is_touching
    yield Diagnostic(
        level="warn" if touches else "ok", name="bumper", message="touches something" if touches else "",
        timestamp=now_us,
    )  # fmt: skip
    speeds = {"left": f"{motion.left_mps:.2f} m/s", "right": f"{motion.right_mps:.2f} m/s"}
    yield Diagnostic(level="ok", name="motors", values=speeds, timestamp=now_us)


class SimHealthConfigurer(DataChannelConfigurer[SimHealthParams]):
    """How the parts of the simulated robot are."""

    connector_type = "sim-health"

    def configure(self) -> SimHealth:
        return SimHealth(self.label, self.params, shared_world(self.shared, self.params.seed))
