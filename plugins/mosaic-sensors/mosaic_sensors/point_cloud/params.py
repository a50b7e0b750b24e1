"""Models the params of every point cloud connector, whatever its source."""

from __future__ import annotations

from typing import Annotated, Self, TypeAlias

from pydantic import Field, model_validator

from mosaic_core.contract.params import Params
from mosaic_sensors.point_cloud.deflation import Compress
from mosaic_sensors.point_cloud.original_form import StreamMode

Corner: TypeAlias = Annotated[tuple[float, float, float], Field(description="[x, y, z] in metres.")]


class PointCloudParams(Params):
    """What is kept of a cloud and how it is sent; derive the params of a connector that sends some from it."""

    voxel_size_m: float = Field(default=0.0, ge=0, le=100, description="Keep one point per cube of this edge; 0: all.")
    max_points: int = Field(default=200_000, ge=1, le=2_000_000, description="Most points of one cloud.")
    max_rate_hz: float = Field(default=10.0, gt=0, le=100, description="Clouds beyond this rate are left out.")
    resolution_m: float = Field(default=0.01, ge=1e-5, le=10, description="Coordinates are rounded to this.")
    crop_min_m: Corner | None = Field(default=None, description="Lower corner of a box; what is outside is left out.")
    crop_max_m: Corner | None = Field(default=None, description="Upper corner of the box.")
    min_range_m: float = Field(default=0.0, ge=0, description="Nearer points are left out, the robot's own body say.")
    max_range_m: float | None = Field(default=None, gt=0, description="Farther points are left out.")
    compress: Compress = Field(default="auto", description="Deflate: when it pays (auto), never, or always.")
    parallel_num: int = Field(
        default=1, ge=1, le=16, description="Channels <label>-0, <label>-1 … for original dashboards."
    )
    stream_mode: StreamMode = Field(
        default="progressive",
        description="For original dashboards; progressive: each chunk samples the whole cloud; simple: in its order.",
    )

    @model_validator(mode="after")
    def _something_stays(self) -> Self:
        if self.max_range_m is not None and self.max_range_m <= self.min_range_m:
            raise ValueError(f"max_range_m ({self.max_range_m}) is not beyond min_range_m ({self.min_range_m})")
        low, high = self.crop_min_m, self.crop_max_m
        if low is not None and high is not None and any(a >= b for a, b in zip(low, high, strict=True)):
            raise ValueError(f"crop_min_m {low} is not below crop_max_m {high} on every axis")
        return self
