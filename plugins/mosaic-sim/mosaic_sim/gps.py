"""`sim-gps`: the simulated robot's place on Earth, from an origin that can be chosen."""

from __future__ import annotations

import math
from collections.abc import Iterator

from pydantic import Field

from mosaic_core import DataChannelConfigurer, DataChannelSendable, Delivery
from mosaic_core.messages import GpsFix, wall_time_us
from mosaic_sim.live_world import LiveWorld, SimParams, shared_world

WGS84_SEMI_MAJOR_M = 6_378_137.0
WGS84_ECCENTRICITY_SQUARED = 6.694_379_990_14e-3


class SimGpsParams(SimParams):
    period_s: float = Field(default=0.5, gt=0, le=3600, description="Seconds between two messages.")
    latitude_deg: float = Field(default=51.47783, ge=-89, le=89, description="Of the yard's centre.")
    longitude_deg: float = Field(default=-0.00147, ge=-180, le=180, description="Of the yard's centre.")
    altitude_m: float = Field(default=46.0, description="Above the ellipsoid.")
    noise_m: float = Field(default=0.01, ge=0, description="Standard deviation per axis; 0.01 m is what RTK reaches.")


def to_wgs84(latitude_deg: float, longitude_deg: float, east_m: float, north_m: float) -> tuple[float, float]:
    """Latitude and longitude of a point near an origin (local tangent plane; exact to millimetres within a kilometre).

    The radii of curvature are those of the WGS84 ellipsoid (NIMA TR8350.2, §4).
    """
    latitude_rad = math.radians(latitude_deg)
    w_squared = 1.0 - WGS84_ECCENTRICITY_SQUARED * math.sin(latitude_rad) ** 2
    prime_vertical_m = WGS84_SEMI_MAJOR_M / math.sqrt(w_squared)
    meridian_m = prime_vertical_m * (1.0 - WGS84_ECCENTRICITY_SQUARED) / w_squared
    return (
        latitude_deg + math.degrees(north_m / meridian_m),
        longitude_deg + math.degrees(east_m / (prime_vertical_m * math.cos(latitude_rad))),
    )


class SimGps(DataChannelSendable[GpsFix]):
    delivery = Delivery.LATEST

    def __init__(self, label: str, params: SimGpsParams, world: LiveWorld) -> None:
        super().__init__(label)
        self._params = params
        self._world = world

    def messages(self) -> Iterator[GpsFix]:
        noise = self._world.world.noise(self.label)
        params = self._params
        for _ in self.every(params.period_s):
            motion = self._world.state.motion
            east_m, north_m, up_m = noise.normal((motion.x_m, motion.y_m, params.altitude_m), params.noise_m)
            latitude, longitude = to_wgs84(params.latitude_deg, params.longitude_deg, east_m, north_m)
            yield GpsFix(
                latitude=latitude,
                longitude=longitude,
                altitude=round(up_m, 3),
                timestamp=wall_time_us(),
            )


class SimGpsConfigurer(DataChannelConfigurer[SimGpsParams]):
    """GPS of the simulated robot (WGS84)."""

    connector_type = "sim-gps"

    def configure(self) -> SimGps:
        return SimGps(self.label, self.params, shared_world(self.shared, self.params.seed))
