"""Models the params that describe a depth camera, alike in all connectors that show it."""

from __future__ import annotations

from pydantic import Field, field_validator

from mosaic_core.contract.params import Params, unit
from mosaic_depth.camera_registry import opener_of


class DepthCameraParams(Params):
    """Which depth camera, and the mode it shall run in."""

    source: str = Field(
        default="realsense",
        max_length=512,
        description="The kind of camera, and where it is: `realsense` for the first one, `realsense:SERIAL`, "
        "`realsense:FILE` for a recording of one, `fake` for one that is made up; plugins add further kinds.",
    )
    width: int = Field(
        default=640, ge=16, le=4096, description="Pixels of both pictures.", json_schema_extra=unit("px")
    )
    height: int = Field(
        default=480, ge=16, le=4096, description="Pixels of both pictures.", json_schema_extra=unit("px")
    )
    fps: int = Field(default=30, ge=1, le=120, description="Pictures per second.", json_schema_extra=unit("1/s"))

    @field_validator("source")
    @classmethod
    def _is_installed(cls, source: str) -> str:
        opener_of(source.partition(":")[0])
        return source

    @property
    def kind(self) -> str:
        """The name of its entry point."""
        return self.source.partition(":")[0]

    @property
    def address(self) -> str:
        """What follows the kind: a serial number, a file, an address; empty: the first camera there is."""
        return self.source.partition(":")[2]
