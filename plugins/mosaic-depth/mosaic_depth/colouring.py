"""Colours a depth picture: what is near is red, what is far is blue, what is not known is black. Pure."""

from __future__ import annotations

from functools import cache

import numpy as np

from mosaic_core.contract.media import Image
from mosaic_depth.depth_camera import Depth


def coloured(depth_m: Depth, near_m: float, far_m: float) -> Image:
    """A BGR picture. Nearer than ``near_m`` is as red as that, farther than ``far_m`` as blue."""
    with np.errstate(invalid="ignore"):
        nearness = np.clip((far_m - depth_m) * (254.0 / (far_m - near_m)), 0.0, 254.0) + 1.0
    is_known = np.isfinite(depth_m) & (depth_m > 0)
    levels = np.where(is_known, nearness, 0.0).astype(np.uint8)
    return np.asarray(_palette()[levels])


@cache
def _palette() -> Image:
    """Black, and 255 colours of *Turbo*, whose brightness rises and falls evenly (A. Mikhailov, 2019)."""
    import cv2

    ramp = np.arange(256, dtype=np.uint8)
    palette = np.asarray(cv2.applyColorMap(ramp, cv2.COLORMAP_TURBO), np.uint8).reshape(256, 3)
    palette[0] = 0
    return palette
