"""Noise of 8x8 blocks that moves and wraps around under the noise of a sensor, with marks: it needs every bit there is
and has no cuts. Without the sensor's noise an encoder that follows motion soon needs no bits at all."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

import cv2
import numpy as np
from video_bench.scene import Image

from mosaic_camera.marks import draw_marks

BLOCK_PX, STEP_PX = 8, 2
SENSOR_LEVELS, SENSOR_PICTURES = 12, 7


class NoiseCamera:
    """Posts pictures from a thread of its own until :meth:`end`."""

    def __init__(self, size: tuple[int, int], fps: float, seed: int, post: Callable[[Image, float], object]) -> None:
        self._size, self._fps, self._post = size, fps, post
        self._random = np.random.default_rng(seed)
        self._later_s = float(self._random.random()) / fps
        width, height = size
        self._sensor = self._random.integers(0, SENSOR_LEVELS, (SENSOR_PICTURES, height, width, 3), np.uint8)
        self._is_over = threading.Event()
        self.cut()
        self._thread = threading.Thread(target=self._run, name=f"camera {seed}", daemon=True)
        self._thread.start()

    def cut(self) -> None:
        """Another scene from the next picture on."""
        width, height = self._size
        blocks = self._random.integers(0, 256, (height // BLOCK_PX, width // BLOCK_PX, 3), np.uint8)
        self._noise = np.tile(blocks.repeat(BLOCK_PX, 0).repeat(BLOCK_PX, 1), (1, 2, 1))

    def end(self) -> None:
        self._is_over.set()
        self._thread.join()

    def _run(self) -> None:
        began_s, frame = time.monotonic() + self._later_s, 0
        while not self._is_over.wait(max(0.0, began_s + frame / self._fps - time.monotonic())):
            captured_at_s = time.monotonic()
            left = frame * STEP_PX % self._size[0]
            image = cv2.add(self._noise[:, left : left + self._size[0]], self._sensor[frame % SENSOR_PICTURES])
            draw_marks(image, frame, captured_at_s)
            self._post(image, captured_at_s)
            frame = max(frame + 1, int((time.monotonic() - began_s) * self._fps))
