"""Point clouds: from arrays, files or datagrams to the dashboard. What a plugin of one's own derives from and calls."""

from mosaic_sensors.point_cloud.cloud import PointCloud, cloud_of
from mosaic_sensors.point_cloud.compact_form import decoded
from mosaic_sensors.point_cloud.params import PointCloudParams
from mosaic_sensors.point_cloud.sender import PointCloudSender

__all__ = ["PointCloud", "PointCloudParams", "PointCloudSender", "cloud_of", "decoded"]
