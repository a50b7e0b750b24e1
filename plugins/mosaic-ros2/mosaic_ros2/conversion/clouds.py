"""Makes point clouds of ROS' ``PointCloud2``, which look at the message's own bytes."""

from __future__ import annotations

from typing import Any

import numpy as np

from mosaic_ros2.conversion.parts import MAX_NAME, Ros
from mosaic_sensors.point_cloud import PointCloud, cloud_of

_CODES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
"""sensor_msgs/PointField."""
MAX_FIELDS = 64


def cloud_from(message: Ros, captured_at_s: float) -> PointCloud:
    """The points of a cloud. Raises :class:`ValueError` that says what doesn't fit."""
    height, width = message["height"], message["width"]
    point_step, row_step, data = message["point_step"], message["row_step"], message["data"]
    used = width * point_step
    if height * width and (row_step < used or len(data) < row_step * (height - 1) + used):
        raise ValueError(
            f"{len(data)} bytes in rows of {row_step} are no {width}×{height} points of {point_step} bytes"
        )
    kind = _point_type(message)
    if row_step != used and height > 1:
        points: Any = np.ndarray((height, width), kind, buffer=data, strides=(row_step, point_step))
    else:
        points = np.ndarray((height * width,), kind, buffer=data, strides=(point_step,))
    return cloud_of(points, frame_id=message["header"]["frame_id"][:MAX_NAME], captured_at_s=captured_at_s)


def _point_type(message: Ros) -> np.dtype[Any]:
    """The fields of one point; those of several numbers are not needed."""
    order, step = ">" if message["is_bigendian"] else "<", message["point_step"]
    fields = [one for one in message["fields"][:MAX_FIELDS] if one["count"] <= 1]
    for one in fields:
        code = _CODES.get(one["datatype"])
        if code is None or one["offset"] + int(code[1]) > step:
            raise ValueError(f"its field {one['name'][:40]!r} does not lie within {step} bytes")
    names = [one["name"] for one in fields]
    if not names or len(set(names)) != len(names):
        raise ValueError("its fields have no names, or one name twice")
    formats = [order + _CODES[one["datatype"]] for one in fields]
    offsets = [one["offset"] for one in fields]
    return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": step})
