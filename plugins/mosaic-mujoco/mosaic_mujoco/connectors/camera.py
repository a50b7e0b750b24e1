"""`mujoco-camera`: what a camera of the model sees, drawn on a thread of its own."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

from pydantic import Field

from mosaic_core import Captured, EncodingParams, MediaTrackConfigurer, MediaTrackHandler, unit
from mosaic_mujoco.params import CameraName, MujocoParams
from mosaic_mujoco.world.drawing import Drawing, DrawnPixels, FreeView
from mosaic_mujoco.world.simulation import SimulatedMoment, Simulation


class MujocoCameraParams(MujocoParams, EncodingParams):
    camera: CameraName | None = Field(
        default=None, description="A camera of the model; none: a free one, which looks at the middle of everything."
    )
    width: int = Field(default=480, ge=64, le=1920, multiple_of=2, description="Pixels.", json_schema_extra=unit("px"))
    height: int = Field(default=360, ge=48, le=1080, multiple_of=2, description="Pixels.", json_schema_extra=unit("px"))
    fps: float = Field(
        default=12.0,
        gt=0,
        le=60,
        description="Pictures per second. Without a graphics card 480 × 360 take some 15 ms each.",
        json_schema_extra=unit("1/s"),
    )
    shadows: bool = Field(
        default=False, description="Shadows and reflections; without a graphics card they take five times as long."
    )
    azimuth_deg: float | None = Field(default=None, description="Of the free camera: from where it looks, around z.")
    elevation_deg: float | None = Field(default=None, ge=-90, le=90, description="Of the free camera: -90 looks down.")
    distance_m: float | None = Field(default=None, gt=0, description="Of the free camera: from what it looks at.")


class MujocoCamera(MediaTrackHandler):
    """Draws only while somebody watches; of a simulation that stands still the same picture again."""

    widget = "video"

    def __init__(self, label: str, params: MujocoCameraParams, simulation: Simulation) -> None:
        super().__init__(label)
        self.encoding = params
        self._params = params
        self._simulation = simulation

    def frames(self) -> Iterator[Captured]:
        params = self._params
        camera = params.camera or FreeView(params.azimuth_deg, params.elevation_deg, params.distance_m)
        drawing = Drawing(self._simulation, camera, params.width, params.height, has_shadows=params.shadows)
        picture: DrawnPixels | None = None
        drawn: SimulatedMoment | None = None
        tick_before = -1
        with drawing:
            for tick in self.every(1.0 / params.fps):
                if tick > tick_before + 1:  # drawing takes longer than there is time
                    self.count_loss("thinned", tick - tick_before - 1)
                tick_before = tick
                captured_at_s, moment = self.monotonic_s(), self._simulation.moment
                if picture is None or moment is not drawn:  # a reset is another moment, too
                    picture, drawn = drawing.drawn(), moment
                yield Captured(picture, captured_at_s)


class MujocoCameraConfigurer(MediaTrackConfigurer[MujocoCameraParams]):
    """Camera of a MuJoCo model, drawn without a screen."""

    connector_type = "mujoco-camera"
    example: ClassVar[dict[str, Any] | None] = {"model": "arm", "camera": "overview"}

    def configure(self) -> MujocoCamera:
        return MujocoCamera(self.label, self.params, self.params.simulation(self.shared).simulation)
