"""`sim-mast` and `sim-mast-target`: a mast on the simulated robot whose two joints turn to where they are told."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator, Mapping, Sequence

from pydantic import Field

from mosaic_core import (
    DataChannelConfigurer,
    DataChannelReceivable,
    DataChannelSendable,
    Delivery,
    FieldBounds,
    NoParams,
    Params,
    Shared,
)
from mosaic_core.messages import JointState, JointTarget, wall_time_us

RANGES_RAD = {"mast_pan": (-2.0, 2.0), "mast_tilt": (-0.6, 0.9)}
SPEED_RADPS = 1.0
TIMEOUT_S = 5.0
"""A target is said once, and from one end to the other a joint turns for 4 s. Only where nobody says anything for
longer it stays where it is, also in the middle of a slow way."""


class Mast:
    """The two joints. They turn when they are looked at; any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._at = dict.fromkeys(RANGES_RAD, 0.0)
        self._goal = dict(self._at)
        self._speed = dict.fromkeys(RANGES_RAD, SPEED_RADPS)
        self._seen_at_s: float | None = None

    def __enter__(self) -> Mast:
        return self

    def __exit__(self, *_: object) -> None:
        """Nothing is held: it turns only while somebody looks."""

    def aim(self, goals: dict[str, float], duration_s: float | None, now_s: float) -> None:
        """Turn there, as far as the joints reach."""
        with self._lock:
            self._turn(now_s)
            for name, goal in goals.items():
                low, high = RANGES_RAD[name]
                self._goal[name] = min(high, max(low, goal))
                way = abs(self._goal[name] - self._at[name])
                self._speed[name] = min(SPEED_RADPS, way / duration_s) if duration_s else SPEED_RADPS

    def halt(self, now_s: float) -> None:
        """Stay where it is."""
        with self._lock:
            self._turn(now_s)
            self._goal = dict(self._at)

    def look(self, now_s: float) -> tuple[dict[str, float], dict[str, float]]:
        """Positions and velocities now."""
        with self._lock:
            self._turn(now_s)
            velocities = {
                name: 0.0 if goal == self._at[name] else self._speed[name] * (1 if goal > self._at[name] else -1)
                for name, goal in self._goal.items()
            }
            return dict(self._at), velocities

    def _turn(self, now_s: float) -> None:
        passed_s = 0.0 if self._seen_at_s is None else max(0.0, now_s - self._seen_at_s)
        self._seen_at_s = now_s
        for name, goal in self._goal.items():
            way, most = goal - self._at[name], self._speed[name] * passed_s
            self._at[name] = goal if abs(way) <= most else self._at[name] + math.copysign(most, way)


def shared_mast(shared: Shared) -> Mast:
    """The robot's one mast; whoever asks first makes it."""
    return shared.get("mosaic-sim:mast", Mast)


class SimMastParams(Params):
    period_s: float = Field(default=0.1, gt=0, le=60, description="Seconds between two messages.")


class SimMast(DataChannelSendable[JointState]):
    delivery = Delivery.LATEST

    def __init__(self, label: str, params: SimMastParams, mast: Mast) -> None:
        super().__init__(label)
        self._params = params
        self._mast = mast

    def messages(self) -> Iterator[JointState]:
        for _ in self.every(self._params.period_s):
            positions, velocities = self._mast.look(self.monotonic_s())
            yield JointState(
                names=list(positions),
                positions=[round(value, 4) for value in positions.values()],
                velocities=list(velocities.values()),
                timestamp=wall_time_us(),
            )


class SimMastConfigurer(DataChannelConfigurer[SimMastParams]):
    """How the joints of the simulated mast stand."""

    connector_type = "sim-mast"

    def configure(self) -> SimMast:
        return SimMast(self.label, self.params, shared_mast(self.shared))


class SimMastTarget(DataChannelReceivable[JointTarget]):
    requires_lease = True
    timeout_s = TIMEOUT_S
    item_names: Sequence[str] = tuple(RANGES_RAD)
    limits: Mapping[str, FieldBounds] = {
        f"positions.{name}": FieldBounds(min=low, max=high) for name, (low, high) in RANGES_RAD.items()
    }

    def __init__(self, label: str, mast: Mast) -> None:
        super().__init__(label)
        self._mast = mast

    def handle_data(self, data: JointTarget) -> None:
        self._mast.aim(dict(zip(data.names, data.positions, strict=True)), data.duration_s, self.monotonic_s())

    def reported_position(self, field: str) -> float | None:
        positions, _ = self._mast.look(self.monotonic_s())
        return positions.get(field.removeprefix("positions."))

    def make_safe(self, cause: str) -> None:
        self._mast.halt(self.monotonic_s())


class SimMastTargetConfigurer(DataChannelConfigurer[NoParams]):
    """Turns the joints of the simulated mast."""

    connector_type = "sim-mast-target"

    def configure(self) -> SimMastTarget:
        return SimMastTarget(self.label, shared_mast(self.shared))
