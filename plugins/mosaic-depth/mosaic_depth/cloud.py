"""The ``depth-cloud`` connector: a depth camera's coloured points, and the pinhole that they were seen through."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Any, ClassVar

from pydantic import Field

from mosaic_core import DataChannelConfigurer, DataChannelSendable, Delivery, DeliveryContract, Handler, Message, unit
from mosaic_depth.depth_camera import DepthFrame
from mosaic_depth.params import DepthCameraParams
from mosaic_depth.pictures import TRIAL
from mosaic_depth.projection import cloud_of_frame
from mosaic_depth.shared_camera import SharedDepthCamera, shared_camera
from mosaic_sensors.point_cloud import PointCloud, PointCloudParams, PointCloudSender


class DepthCloudParams(PointCloudParams):
    camera: DepthCameraParams = Field(
        default_factory=DepthCameraParams, description="The depth camera; alike in all connectors of one."
    )
    step_px: int = Field(
        default=2,
        ge=1,
        le=64,
        description="Of so many pixels of a row, and of so many rows, one becomes a point.",
        json_schema_extra=unit("px"),
    )
    frame_id: str = Field(default="", max_length=64, description="The coordinate frame of the camera.")


class CameraIntrinsics(Message):
    """The pinhole behind both pictures and the cloud, of the whole picture whatever ``step_px`` is."""

    width_px: int
    height_px: int
    fx_px: float = Field(json_schema_extra=unit("px"))
    fy_px: float = Field(json_schema_extra=unit("px"))
    cx_px: float = Field(json_schema_extra=unit("px"))
    cy_px: float = Field(json_schema_extra=unit("px"))
    frame_id: str | None = None


class IntrinsicsSender(DataChannelSendable[CameraIntrinsics]):
    """Tells a camera's intrinsics, once it was seen; who comes later gets them at once."""

    delivery: ClassVar[Delivery | DeliveryContract] = DeliveryContract(mode=Delivery.RELIABLE, latch=True)


class DepthCloud(PointCloudSender):
    """Sends the points of a depth camera. The intrinsics go out beside, whenever they are others than before."""

    def __init__(self, label: str, params: DepthCloudParams, camera: SharedDepthCamera) -> None:
        super().__init__(label, params)
        self.params = params
        self.intrinsics = IntrinsicsSender(f"{label}_intrinsics")
        self._camera = camera

    def clouds(self) -> Iterator[Callable[[], PointCloud]]:
        told: CameraIntrinsics | None = None
        for frame in self._camera.frames(self):
            found = self._intrinsics_of(frame)
            if found != told:
                self.intrinsics.send_json(found)
                told = found
            yield partial(cloud_of_frame, frame, self.params.step_px, self.params.frame_id)

    def handlers(self) -> Sequence[Handler]:
        return (*super().handlers(), self.intrinsics)

    def _intrinsics_of(self, frame: DepthFrame) -> CameraIntrinsics:
        height_px, width_px = frame.depth_m.shape
        of = frame.intrinsics
        return CameraIntrinsics(
            width_px=width_px, height_px=height_px, frame_id=self.params.frame_id or None,
            fx_px=of.fx_px, fy_px=of.fy_px, cx_px=of.cx_px, cy_px=of.cy_px,
        )  # fmt: skip


class DepthCloudConfigurer(DataChannelConfigurer[DepthCloudParams]):
    """The coloured point cloud of a depth camera, and its intrinsics."""

    connector_type = "depth-cloud"
    trial: ClassVar[dict[str, Any] | None] = TRIAL
    example: ClassVar[dict[str, Any] | None] = {
        "camera": {"source": "realsense"},
        "max_range_m": 4,
        "voxel_size_m": 0.02,
    }

    def configure(self) -> Sequence[Handler]:
        return DepthCloud(self.label, self.params, shared_camera(self.params.camera, self.shared)).handlers()
