"""The ``depth-camera`` and ``depth-picture`` connectors: what a depth camera sees, and how far it is, as colours."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar, Self

from pydantic import Field, model_validator

from mosaic_core import Captured, EncodingParams, MediaTrackConfigurer, MediaTrackHandler
from mosaic_depth.colouring import coloured
from mosaic_depth.params import DepthCameraParams
from mosaic_depth.shared_camera import SharedDepthCamera, shared_camera

TRIAL: dict[str, Any] = {"camera": {"source": "fake"}}


class ColourParams(EncodingParams):
    camera: DepthCameraParams = Field(
        default_factory=DepthCameraParams, description="The depth camera; alike in all connectors of one."
    )


class ColourPicture(MediaTrackHandler):
    """Sends a depth camera's colour picture to operators."""

    widget: ClassVar[str | None] = "video"

    def __init__(self, label: str, params: ColourParams, camera: SharedDepthCamera) -> None:
        super().__init__(label)
        self.encoding = params
        self._camera = camera

    def frames(self) -> Iterator[Captured]:
        for frame in self._camera.frames(self):
            yield Captured(frame.colour, frame.captured_at_s or self.monotonic_s())


class DepthCameraConfigurer(MediaTrackConfigurer[ColourParams]):
    """The colour picture of a depth camera."""

    connector_type = "depth-camera"
    trial: ClassVar[dict[str, Any] | None] = TRIAL
    example: ClassVar[dict[str, Any] | None] = {"camera": {"source": "realsense", "width": 640, "height": 480}}

    def configure(self) -> ColourPicture:
        return ColourPicture(self.label, self.params, shared_camera(self.params.camera, self.shared))


class DepthPictureParams(ColourParams):
    near_m: float = Field(default=0.3, ge=0, le=100, description="What is so near, or nearer, is red.")
    far_m: float = Field(default=4.0, gt=0, le=1000, description="What is so far, or farther, is blue.")

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.far_m <= self.near_m:
            raise ValueError(f"far_m ({self.far_m}) is not beyond near_m ({self.near_m})")
        return self


class DepthPicture(MediaTrackHandler):
    """Sends a depth camera's depth picture to operators, as colours."""

    widget: ClassVar[str | None] = "video"

    def __init__(self, label: str, params: DepthPictureParams, camera: SharedDepthCamera) -> None:
        super().__init__(label)
        self.encoding = params
        self._params = params
        self._camera = camera

    def frames(self) -> Iterator[Captured]:
        near_m, far_m = self._params.near_m, self._params.far_m
        for frame in self._camera.frames(self):
            yield Captured(coloured(frame.depth_m, near_m, far_m), frame.captured_at_s or self.monotonic_s())


class DepthPictureConfigurer(MediaTrackConfigurer[DepthPictureParams]):
    """The depth picture of a depth camera, as colours: near is red, far is blue, unknown is black."""

    connector_type = "depth-picture"
    trial: ClassVar[dict[str, Any] | None] = TRIAL
    example: ClassVar[dict[str, Any] | None] = {"camera": {"source": "realsense"}, "near_m": 0.3, "far_m": 4.0}

    def configure(self) -> DepthPicture:
        return DepthPicture(self.label, self.params, shared_camera(self.params.camera, self.shared))
