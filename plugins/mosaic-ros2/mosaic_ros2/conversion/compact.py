"""Converts MOSAIC's compact forms of scans and point clouds, in which sensors send them, to messages of ROS."""

from __future__ import annotations

from typing import Any

import numpy as np

from mosaic_ros2.conversion.parts import Origin, Ros, ros_header
from mosaic_sensors.laser_scan import Scan
from mosaic_sensors.point_cloud import PointCloud

FLOAT32 = 7
"""sensor_msgs/PointField."""


def scan_fields(scan: Scan, origin: Origin) -> Ros:
    """A ``sensor_msgs/LaserScan``: infinity where nothing came back."""
    span = max(0, len(scan) - 1) * scan.angle_increment_rad
    return {
        "header": ros_header(origin, scan),
        "angle_min": scan.angle_min_rad,
        "angle_max": scan.angle_min_rad + span,
        "angle_increment": scan.angle_increment_rad,
        "time_increment": scan.scan_time_s / max(1, len(scan)),
        "scan_time": scan.scan_time_s,
        "range_min": scan.range_min_m,
        "range_max": scan.range_max_m,
        "ranges": np.nan_to_num(scan.ranges_m, nan=np.inf, posinf=np.inf),
        "intensities": [] if scan.intensities is None else scan.intensities.astype(np.float32),
    }


def cloud_fields(cloud: PointCloud, origin: Origin) -> Ros:
    """A ``sensor_msgs/PointCloud2`` of one row, in single precision, as PCL reads it; colours as it packs them."""
    columns: dict[str, Any] = {name: cloud.xyz[:, at] for at, name in enumerate("xyz")}
    if cloud.intensity is not None:
        columns["intensity"] = cloud.intensity
    if cloud.rgb is not None:
        red, green, blue = cloud.rgb.astype(np.uint32).T
        columns["rgb"] = (red << 16 | green << 8 | blue).view(np.float32)
    points = np.empty((len(cloud), len(columns)), np.float32)
    for at, column in enumerate(columns.values()):
        points[:, at] = column
    return {
        "header": ros_header(origin, cloud),
        "height": 1,
        "width": len(cloud),
        "fields": [
            {"name": name, "offset": 4 * at, "datatype": FLOAT32, "count": 1} for at, name in enumerate(columns)
        ],
        "point_step": 4 * len(columns),
        "row_step": points.nbytes,
        "data": points.reshape(-1).view(np.uint8),
        "is_dense": True,
    }
