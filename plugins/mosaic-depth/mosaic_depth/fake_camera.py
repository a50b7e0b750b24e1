"""A depth camera that is made up: a wall, a floor, and a ball that swings before them."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import numpy as np

from mosaic_depth.depth_camera import DepthFrame, Intrinsics
from mosaic_depth.params import DepthCameraParams

WALL_M = 3.0
HEIGHT_M = 0.5
"""Of the camera over its floor."""
BALL_M, BALL_RADIUS_M = 1.2, 0.2
SWING_S = 4.0
"""From one side to the other and back."""
BLIND_SHARE = 1 / 32
"""The left edge, which only one of two eyes sees: its depth is not known, as of a real one."""


class FakeDepthCamera:
    """Gives pictures in the rate that is asked for. ``pause`` waits; tests give another one."""

    def __init__(self, params: DepthCameraParams, pause: Callable[[float], object] = time.sleep) -> None:
        width, height = params.width, params.height
        focal_px = 0.9 * width
        self._intrinsics = Intrinsics(focal_px, focal_px, (width - 1) / 2, (height - 1) / 2)
        self._period_s = self._left_s = 1 / params.fps
        self._pause = pause
        self._number = 0
        self._right = (np.arange(width, dtype=np.float32) - self._intrinsics.cx_px) / focal_px
        self._down = ((np.arange(height, dtype=np.float32) - self._intrinsics.cy_px) / focal_px)[:, None]
        with np.errstate(divide="ignore"):
            floor_m = np.where(self._down > 0, HEIGHT_M / self._down, np.inf)
        depth = np.broadcast_to(np.minimum(floor_m, WALL_M), (height, width)).astype(np.float32)
        self._depth_m = depth
        self._blind_px = max(1, int(width * BLIND_SHARE))
        is_floor = np.broadcast_to(floor_m < WALL_M, (height, width))
        self._colour = np.where(is_floor[..., None], (90, 120, 140), (200, 190, 170)).astype(np.uint8)

    def next(self, timeout_s: float) -> DepthFrame | None:
        """The next picture of the room, when its time has come."""
        waited_s = min(self._left_s, timeout_s)
        self._pause(waited_s)
        self._left_s -= waited_s
        if self._left_s > 0:
            return None
        self._left_s = self._period_s
        self._number += 1
        return self._drawn(self._number * self._period_s)

    def close(self) -> None:
        """There is nothing to let go."""

    def _drawn(self, at_s: float) -> DepthFrame:
        aside = 0.5 * math.sin(2 * math.pi * at_s / SWING_S) / BALL_M
        square = BALL_RADIUS_M**2 - BALL_M**2 * ((self._right - aside) ** 2 + self._down**2)
        is_ball = square > 0
        depth, colour = self._depth_m.copy(), self._colour.copy()
        depth[is_ball] = BALL_M - np.sqrt(square[is_ball])
        colour[is_ball] = (40, 60, 220)
        depth[:, : self._blind_px] = 0
        return DepthFrame(colour, depth, self._intrinsics)
