"""`sim-battery`: the simulated robot's battery, which motion drains and the dock in the yard's corner fills."""

from __future__ import annotations

from collections.abc import Iterator

from pydantic import Field

from mosaic_core import DataChannelConfigurer, DataChannelSendable
from mosaic_core.messages import BatteryState
from mosaic_sim.live_world import LiveWorld, SimParams, shared_world


class SimBatteryParams(SimParams):
    period_s: float = Field(default=1.0, gt=0, le=3600, description="Seconds between two messages.")


class SimBattery(DataChannelSendable[BatteryState]):
    def __init__(self, label: str, params: SimBatteryParams, world: LiveWorld) -> None:
        super().__init__(label)
        self._params = params
        self._world = world

    def messages(self) -> Iterator[BatteryState]:
        for _ in self.every(self._params.period_s):
            battery = self._world.state.battery
            yield BatteryState(
                percent=round(battery.percent, 2),
                voltage_v=round(battery.voltage_v, 3),
                current_a=round(battery.current_a, 3),
                charging=battery.is_charging,
            )


class SimBatteryConfigurer(DataChannelConfigurer[SimBatteryParams]):
    """Battery of the simulated robot."""

    connector_type = "sim-battery"

    def configure(self) -> SimBattery:
        return SimBattery(self.label, self.params, shared_world(self.shared, self.params.seed))
