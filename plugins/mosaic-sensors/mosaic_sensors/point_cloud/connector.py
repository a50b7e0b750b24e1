"""The ``point-cloud`` connector: clouds from files or from another program's datagrams."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, ClassVar

from pydantic import Field, field_validator

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import Handler
from mosaic_sensors.point_cloud.cloud import PointCloud
from mosaic_sensors.point_cloud.cloud_files import CloudFiles
from mosaic_sensors.point_cloud.params import PointCloudParams
from mosaic_sensors.point_cloud.sender import PointCloudSender
from mosaic_sensors.point_cloud.udp import UdpPointCloud
from mosaic_sensors.udp_socket import udp_address


class PointCloudSourceParams(PointCloudParams):
    source: str = Field(
        min_length=1,
        description="A PLY, PCD, NPY or NPZ file; a folder or pattern (scans/*.pcd), played in the order of its names; "
        "udp://address:port; or `sample`: a small one that this package brings.",
    )
    rate_hz: float = Field(default=1.0, gt=0, le=100, description="Clouds per second from files.")
    loop: bool = Field(default=True, description="Begin again after the last file.")
    frame_id: str = Field(default="", max_length=64, description="The coordinate frame that the points are in.")

    @field_validator("source")
    @classmethod
    def _address(cls, source: str) -> str:
        if source.startswith("udp:"):
            udp_address(source)
        elif "://" in source:
            raise ValueError(f"{source!r} is no source; write a file, a folder, a pattern or udp://address:port")
        return source


class FilePointCloud(PointCloudSender):
    """Plays files."""

    def __init__(self, label: str, params: PointCloudSourceParams) -> None:
        super().__init__(label, params)
        self.params = params
        self._files = CloudFiles(params.source)

    def clouds(self) -> Iterator[PointCloud]:
        ticks = iter(self.every(1.0 / self.params.rate_hz))
        while True:
            for cloud in self._files.one_pass():
                if next(ticks, None) is None:
                    return
                yield replace(cloud, frame_id=self.params.frame_id, captured_at_s=self.monotonic_s())
            if not self.params.loop:
                return


class PointCloudConfigurer(DataChannelConfigurer[PointCloudSourceParams]):
    """Point clouds from files (PLY, PCD, NPY, NPZ) or from another program by UDP."""

    connector_type = "point-cloud"
    trial: ClassVar[dict[str, Any] | None] = {"source": "sample"}
    example: ClassVar[dict[str, Any] | None] = {"source": "scans/*.pcd", "rate_hz": 10, "voxel_size_m": 0.05}

    def configure(self) -> Sequence[Handler]:
        params = self.params
        if params.source.startswith("udp:"):
            return UdpPointCloud(self.label, params, params.source, params.frame_id).handlers()
        return FilePointCloud(self.label, params).handlers()
