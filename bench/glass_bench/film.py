"""Pictures with the time of their capture burnt in, posted at their time from a thread as a camera's handler does."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Literal

from video_bench.scene import Image, scene

from mosaic_camera.marks import draw_marks
from mosaic_camera.pattern import PatternPainter

FPS = 30
Content = Literal["pattern", "scene"]
"""`pattern`: that of `test-pattern`, easy to encode. `scene`: texture and noise that need every bit there is."""


def painter(content: Content, size: tuple[int, int]) -> Callable[[int, float], Image]:
    """``(frame, captured_at_s)`` → picture with marks."""
    if content == "pattern":
        return PatternPainter(*size, FPS).draw
    pictures = scene(*size)

    def drawn(frame: int, captured_at_s: float) -> Image:
        image = pictures[frame % len(pictures)].copy()
        draw_marks(image, frame, captured_at_s)
        return image

    return drawn


class Film:
    """Runs until :meth:`end`."""

    def __init__(self, draw: Callable[[int, float], Image], post: Callable[[Image, float], object]) -> None:
        self._draw, self._post = draw, post
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._run, name="film", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        began_s, frame = time.monotonic(), 0
        while not self._is_over.wait(max(0.0, began_s + frame / FPS - time.monotonic())):
            captured_at_s = time.monotonic()
            self._post(self._draw(frame, captured_at_s), captured_at_s)
            # A picture that is late already is left out, as a camera would.
            frame = max(frame + 1, int((time.monotonic() - began_s) * FPS))

    def end(self) -> None:
        self._is_over.set()
        self._thread.join()
