"""Models the params that all inertial sensors have in common."""

from __future__ import annotations

from pydantic import Field, field_validator

from mosaic_core.contract.params import Params
from mosaic_i2c.bus import FAKE
from mosaic_i2c.mounting import AS_THE_ROBOT, Axes, ImuMounting


class ImuParams(Params):
    source: str = Field(
        default="/dev/i2c-1", description="The bus, /dev/i2c-…, or `fake`: a sensor that is made up, to try it."
    )
    rate_hz: float = Field(default=50.0, gt=0, le=200, description="Readings per second.")
    axes: Axes = Field(
        default=AS_THE_ROBOT, description="The sensor's axis that looks ahead, left and up: [y, -x, z] for example."
    )
    frame_id: str | None = Field(default=None, max_length=64, description="The frame; default: base_link.")

    @field_validator("source")
    @classmethod
    def _is_a_bus(cls, source: str) -> str:
        if source != FAKE and not source.startswith("/dev/"):
            raise ValueError(f"{source!r} is no bus; write /dev/i2c-1, or {FAKE}")
        return source

    @field_validator("axes")
    @classmethod
    def _are_a_rotation(cls, axes: Axes) -> Axes:
        ImuMounting(axes)
        return axes
