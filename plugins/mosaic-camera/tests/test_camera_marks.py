"""Marks in the picture: what is written is read, also after scaling and compression."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mosaic_camera.marks import TICK_S, WRAP, draw_marks, read_marks

numbers = st.integers(0, WRAP - 1)


@settings(deadline=None)
@given(frame=numbers, ticks=numbers)
def test_marks_are_read_as_written(frame: int, ticks: int) -> None:
    image = np.zeros((240, 320, 3), dtype=np.uint8)
    draw_marks(image, frame, ticks * TICK_S)
    marks = read_marks(image)
    assert marks is not None
    assert marks.frame == frame
    assert marks.captured_at_s == pytest.approx(ticks * TICK_S, abs=TICK_S / 10)


@pytest.mark.parametrize("quality", [20, 50, 90])
@pytest.mark.parametrize("size", [(320, 240), (640, 480), (1280, 720)])
def test_marks_survive_compression_and_scaling(quality: int, size: tuple[int, int]) -> None:
    image = np.random.default_rng(0).integers(0, 255, (480, 640, 3), dtype=np.uint8)
    draw_marks(image, 123456, 98.7654)
    _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])
    decoded = cv2.imdecode(data, cv2.IMREAD_COLOR)
    assert decoded is not None
    marks = read_marks(np.asarray(cv2.resize(decoded, size), dtype=np.uint8))
    assert marks is not None
    assert marks.frame == 123456
    assert marks.captured_at_s == pytest.approx(98.7654, abs=1e-4)


def test_gray_pictures_carry_marks_too() -> None:
    image = np.zeros((240, 320), dtype=np.uint8)
    draw_marks(image, 7, 1.5)
    assert read_marks(image) is not None


@pytest.mark.parametrize("level", [0, 100, 255])
def test_a_picture_without_marks_is_not_read_as_one(level: int) -> None:
    assert read_marks(np.full((240, 320, 3), level, dtype=np.uint8)) is None


def test_counters_wrap_instead_of_failing() -> None:
    image = np.zeros((240, 320, 3), dtype=np.uint8)
    draw_marks(image, WRAP + 5, WRAP * TICK_S + 2.0)
    marks = read_marks(image)
    assert marks is not None
    assert marks.frame == 5
    assert marks.captured_at_s == pytest.approx(2.0, abs=TICK_S)
