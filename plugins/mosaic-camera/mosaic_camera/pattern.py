"""`test-pattern`: a moving picture that needs no camera, with frame number and capture time for people and programs."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator

import numpy as np
from pydantic import Field

from mosaic_camera.glyphs import ROWS as GLYPH_ROWS
from mosaic_camera.glyphs import write_text
from mosaic_camera.marks import ROWS, block_height, draw_marks
from mosaic_core import Captured, EncodingParams, MediaTrackConfigurer, MediaTrackHandler, unit
from mosaic_core.contract.media import Image

BARS_BGR = (
    (191, 191, 191), (0, 191, 191), (191, 191, 0), (0, 191, 0), (191, 0, 191), (0, 0, 191), (191, 0, 0),
)  # fmt: skip
"""The 75 % colour bars of SMPTE EG 1: white, yellow, cyan, green, magenta, red, blue."""
TURN_S = 4.0
"""Seconds that the clock hand takes for one turn."""


class TestPatternParams(EncodingParams):
    """Params of a test pattern."""

    __test__ = False

    width: int = Field(default=640, ge=160, le=3840, multiple_of=2, description="Pixels.", json_schema_extra=unit("px"))
    height: int = Field(
        default=480, ge=120, le=2160, multiple_of=2, description="Pixels.", json_schema_extra=unit("px")
    )
    fps: float = Field(default=30.0, gt=0, le=120, description="Pictures per second.", json_schema_extra=unit("1/s"))


class PatternPainter:
    """Draws the pattern: bars and ramp never change, a clock hand and a sliding block always move."""

    def __init__(self, width: int, height: int, fps: float) -> None:
        import cv2

        self._cv2 = cv2
        self._title = f"MOSAIC  {width}x{height}  {fps:g} fps"
        self._scale = height / 480
        self._background = self._still(width, height)

    def draw(self, frame: int, captured_at_s: float) -> Image:
        """Picture number ``frame``, taken at ``captured_at_s`` of the monotonic clock. A new BGR array."""
        image = self._background.copy()
        self._draw_motion(image, captured_at_s)
        now_s = time.time()
        clock = time.strftime("%H:%M:%S", time.localtime(now_s)) + f".{int(now_s % 1 * 1000):03d}"
        self._write(image, f"frame {frame:08d}", 0.64, 1.0)
        self._write(image, clock, 0.72, 1.0)
        draw_marks(image, frame, captured_at_s)
        return image

    def _still(self, width: int, height: int) -> Image:
        bar_of_pixel = np.arange(width) * len(BARS_BGR) // width
        image = np.empty((height, width, 3), dtype=np.uint8)
        image[:] = np.array(BARS_BGR, dtype=np.uint8)[bar_of_pixel]
        ramp_top = height * 3 // 4
        image[ramp_top:] = np.linspace(0, 255, width).astype(np.uint8)[:, None]
        image[height // 2 : ramp_top] = (40, 34, 30)
        self._write(image, self._title, 0.555, 0.6)
        return image

    def _draw_motion(self, image: Image, at_s: float) -> None:
        height, width = image.shape[:2]
        centre, radius = (width // 2, height // 4), height // 5
        angle = at_s / TURN_S * 2 * math.pi
        tip = (round(centre[0] + radius * math.sin(angle)), round(centre[1] - radius * math.cos(angle)))
        thick = max(2, round(6 * self._scale))
        self._cv2.circle(image, centre, radius, (32, 32, 32), -1, self._cv2.LINE_AA)
        self._cv2.circle(image, centre, radius, (245, 245, 245), thick // 2, self._cv2.LINE_AA)
        self._cv2.line(image, centre, tip, (80, 220, 255), thick, self._cv2.LINE_AA)
        size = height // 14
        left = round((0.5 - 0.5 * math.cos(angle / 2)) * (width - size))
        top = height - ROWS * block_height(height) - size - 2
        image[top : top + size, left : left + size] = (80, 220, 255)

    def _write(self, image: Image, text: str, at: float, size: float) -> None:
        """``at``: how far down the picture the foot of the letters is; ``size``: 1 is 21 pixels in a height of 480."""
        square = max(1, round(3 * self._scale * size))
        foot = round(image.shape[0] * at)
        write_text(image, text, round(image.shape[1] * 0.05), foot - GLYPH_ROWS * square, square)


class TestPattern(MediaTrackHandler):
    """Sends a moving test pattern as a camera would."""

    __test__ = False
    widget = "video"

    def __init__(self, label: str, params: TestPatternParams) -> None:
        super().__init__(label)
        self._params = params
        self.encoding = params

    def frames(self) -> Iterator[Captured]:
        params = self._params
        painter = PatternPainter(params.width, params.height, params.fps)
        for frame in self.every(1.0 / params.fps):
            captured_at_s = self.monotonic_s()
            yield Captured(painter.draw(frame, captured_at_s), captured_at_s)


class TestPatternConfigurer(MediaTrackConfigurer[TestPatternParams]):
    """A moving test picture with frame number and time; needs no camera."""

    __test__ = False
    connector_type = "test-pattern"

    def configure(self) -> TestPattern:
        return TestPattern(self.label, self.params)
