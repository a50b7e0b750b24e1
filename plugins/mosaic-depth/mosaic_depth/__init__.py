"""Depth cameras for MOSAIC. What a camera of one's own implements, and is given."""

from mosaic_depth.depth_camera import DepthCamera, DepthFrame, Intrinsics
from mosaic_depth.params import DepthCameraParams

__all__ = ["DepthCamera", "DepthCameraParams", "DepthFrame", "Intrinsics"]
