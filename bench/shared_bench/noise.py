"""Cameras with marks. Noise of 8x8 blocks that moves and wraps around under the noise of a sensor needs every bit there
is; without the sensor's noise an encoder that follows motion soon needs no bits at all. A film is what robots see."""

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


class PostingCamera:
    """Posts pictures from a thread of its own until :meth:`end`."""

    def __init__(self, size: tuple[int, int], fps: float, seed: int, post: Callable[[Image, float], object]) -> None:
        self._size, self._fps, self._post = size, fps, post
        self._random = np.random.default_rng(seed)
        self._later_s = float(self._random.random()) / fps
        self._is_over = threading.Event()
        self.cut()
        self._thread = threading.Thread(target=self._run, name=f"camera {seed}", daemon=True)
        self._thread.start()

    def cut(self) -> None:
        """Another scene from the next picture on."""
        raise NotImplementedError

    def picture(self, frame: int) -> Image:
        """A new picture, of the posting thread."""
        raise NotImplementedError

    def end(self) -> None:
        self._is_over.set()
        self._thread.join()

    def _run(self) -> None:
        began_s, frame = time.monotonic() + self._later_s, 0
        while not self._is_over.wait(max(0.0, began_s + frame / self._fps - time.monotonic())):
            captured_at_s = time.monotonic()
            image = self.picture(frame)
            draw_marks(image, frame, captured_at_s)
            self._post(image, captured_at_s)
            frame = max(frame + 1, int((time.monotonic() - began_s) * self._fps))


class NoiseCamera(PostingCamera):
    """Films noise: each picture costs what the link has."""

    def __init__(self, size: tuple[int, int], fps: float, seed: int, post: Callable[[Image, float], object]) -> None:
        width, height = size
        of_sensor = np.random.default_rng(1000 + seed)
        self._sensor = of_sensor.integers(0, SENSOR_LEVELS, (SENSOR_PICTURES, height, width, 3), np.uint8)
        super().__init__(size, fps, seed, post)

    def cut(self) -> None:
        width, height = self._size
        blocks = self._random.integers(0, 256, (height // BLOCK_PX, width // BLOCK_PX, 3), np.uint8)
        self._noise = np.tile(blocks.repeat(BLOCK_PX, 0).repeat(BLOCK_PX, 1), (1, 2, 1))

    def picture(self, frame: int) -> Image:
        left = frame * STEP_PX % self._size[0]
        return cv2.add(self._noise[:, left : left + self._size[0]], self._sensor[frame % SENSOR_PICTURES])


class FilmCamera(PostingCamera):
    """Shows a film over and over, each camera from elsewhere on; a cut turns it upside down."""

    def __init__(
        self, film: str, size: tuple[int, int], fps: float, seed: int, post: Callable[[Image, float], object]
    ) -> None:
        self._film, self._is_turned = cv2.VideoCapture(film), True
        self._film.set(cv2.CAP_PROP_POS_FRAMES, 50 * seed)
        super().__init__(size, fps, seed, post)

    def cut(self) -> None:
        self._is_turned = not self._is_turned

    def picture(self, frame: int) -> Image:
        is_read, image = self._film.read()
        if not is_read:
            self._film.set(cv2.CAP_PROP_POS_FRAMES, 0)
            is_read, image = self._film.read()
        resized = cv2.resize(image, self._size)
        return cv2.flip(resized, -1) if self._is_turned else resized
