"""Clips that tests make themselves, and a source that tests script."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from mosaic_camera.grabbed import Grabbed, Takes, takes_all
from mosaic_camera.marks import draw_marks

CLIP_FRAMES, CLIP_FPS, CLIP_WIDTH, CLIP_HEIGHT = 12, 10.0, 320, 240


@pytest.fixture(scope="session")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A video file whose pictures carry their numbers as marks: 12 pictures, 10 per second, 320 × 240."""
    path = tmp_path_factory.mktemp("clips") / "numbered.mp4"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), CLIP_FPS, (CLIP_WIDTH, CLIP_HEIGHT))
    assert writer.isOpened()
    for number in range(CLIP_FRAMES):
        image = np.full((CLIP_HEIGHT, CLIP_WIDTH, 3), 40 + 10 * number, dtype=np.uint8)
        draw_marks(image, number, number / CLIP_FPS)
        writer.write(image)
    writer.release()
    return path


class ScriptedSource:
    """Yields what it is given; ``None`` ends it. A live one can be held, as a driver that hangs holds its reader."""

    def __init__(self, pictures: list[Grabbed | None], *, is_live: bool, keeps_order: bool = False) -> None:
        self.is_live = is_live
        self.keeps_order = keeps_order
        self.rewound = 0
        self.is_closed = threading.Event()
        self.may_read = threading.Event()
        self.may_read.set()
        self._pictures = pictures
        self._next = iter(pictures)

    def read(self, takes: Takes = takes_all) -> Grabbed | None:
        self.may_read.wait(10)
        grabbed = next(self._next, None)
        if grabbed is None or self.keeps_order or takes(grabbed.captured_at_s):
            return grabbed
        return replace(grabbed, image=None)

    def rewind(self) -> None:
        self.rewound += 1
        self._next = iter(self._pictures)

    def close(self) -> None:
        self.is_closed.set()


def picture(number: int) -> Grabbed:
    return Grabbed(np.full((8, 8, 3), number, dtype=np.uint8), float(number), float(number))


@pytest.fixture
def scripted() -> Iterator[Callable[..., ScriptedSource]]:
    """Makes scripted sources of n pictures, and lets every reader go at the end."""
    made: list[ScriptedSource] = []

    def make(count: int, *, is_live: bool, key_every: int = 0) -> ScriptedSource:
        """With ``key_every`` its pictures build on each other."""
        pictures: list[Grabbed | None] = [
            replace(picture(number), is_key=not key_every or number % key_every == 0) for number in range(count)
        ]
        made.append(ScriptedSource(pictures, is_live=is_live, keeps_order=bool(key_every)))
        return made[-1]

    yield make
    for source in made:
        source.may_read.set()
