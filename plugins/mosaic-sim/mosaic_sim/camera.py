"""`sim-camera`: what the simulated robot sees ahead of it."""

from __future__ import annotations

from collections.abc import Iterator

from pydantic import Field

from mosaic_core import Captured, EncodingParams, MediaTrackConfigurer, MediaTrackHandler, unit
from mosaic_sim.live_world import LiveWorld, SimParams, shared_world
from mosaic_sim.renderer import Renderer


class SimCameraParams(SimParams, EncodingParams):
    width: int = Field(default=640, ge=64, le=1920, multiple_of=2, description="Pixels.", json_schema_extra=unit("px"))
    height: int = Field(default=480, ge=48, le=1080, multiple_of=2, description="Pixels.", json_schema_extra=unit("px"))
    fps: float = Field(default=20.0, gt=0, le=60, description="Pictures per second.", json_schema_extra=unit("1/s"))
    fov_deg: float = Field(default=75.0, ge=30, le=120, description="Horizontal field of view.")


class SimCamera(MediaTrackHandler):
    widget = "video"

    def __init__(self, label: str, params: SimCameraParams, world: LiveWorld) -> None:
        super().__init__(label)
        self.encoding = params
        self._params = params
        self._world = world
        self._renderer: Renderer | None = None

    def frames(self) -> Iterator[Captured]:
        renderer = self._renderer = self._renderer or self._made_renderer()  # its scenery is kept for the next watching
        for _ in renderer.prepared():
            if self.is_stopping:
                return
        for _ in self.every(1.0 / self._params.fps):
            captured_at_s = self.monotonic_s()
            state = self._world.state
            motion = state.motion
            yield Captured(renderer.render(motion.x_m, motion.y_m, motion.yaw_rad, state.time_s), captured_at_s)

    def _made_renderer(self) -> Renderer:
        params = self._params
        return Renderer(
            self._world.world.room, width=params.width, height=params.height, fov_deg=params.fov_deg, seed=params.seed
        )


class SimCameraConfigurer(MediaTrackConfigurer[SimCameraParams]):
    """First-person camera of the simulated robot."""

    connector_type = "sim-camera"

    def configure(self) -> SimCamera:
        return SimCamera(self.label, self.params, shared_world(self.shared, self.params.seed))
