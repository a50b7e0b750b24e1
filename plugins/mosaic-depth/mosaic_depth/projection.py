"""Turns pictures of a depth camera into points of its body frame, each with its colour. Pure."""

from __future__ import annotations

import numpy as np

from mosaic_depth.depth_camera import DepthFrame
from mosaic_sensors.point_cloud import PointCloud


def cloud_of_frame(frame: DepthFrame, step_px: int = 1, frame_id: str = "") -> PointCloud:
    """A point for each ``step_px``-th pixel of each ``step_px``-th row whose depth is known.

    As all of MOSAIC's (REP-103) x looks ahead, y left, z up; a camera's own z looks ahead, x right, y down.
    """
    depth = frame.depth_m[::step_px, ::step_px]
    rows, columns = np.nonzero(np.isfinite(depth) & (depth > 0))
    ahead_m = depth[rows, columns].astype(np.float32)
    pinhole = frame.intrinsics
    left_m = (pinhole.cx_px - columns * step_px) * ahead_m / pinhole.fx_px
    up_m = (pinhole.cy_px - rows * step_px) * ahead_m / pinhole.fy_px
    xyz = np.stack([ahead_m, left_m, up_m], axis=1).astype(np.float32)
    bgr = frame.colour[::step_px, ::step_px][rows, columns]
    return PointCloud(xyz, None, np.ascontiguousarray(bgr[:, ::-1]), frame_id, frame.captured_at_s)
