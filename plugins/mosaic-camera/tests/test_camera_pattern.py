"""`test-pattern`: it moves, it counts, and programs can read both."""

import numpy as np
import pytest

from mosaic_camera.marks import read_marks
from mosaic_camera.pattern import TestPatternConfigurer
from mosaic_core import Captured, ConfigError
from mosaic_core.testing import FakeClock, build, take_frames


def images(params: dict[str, object], count: int, clock: FakeClock | None = None) -> list[Captured]:
    pictures = take_frames(build(TestPatternConfigurer, params=params, clock=clock), count)
    return [picture for picture in pictures if isinstance(picture, Captured)]


def test_every_picture_carries_its_number_and_capture_time(fake_clock: FakeClock) -> None:
    for number, picture in enumerate(images({"fps": 10}, 5, fake_clock)):
        marks = read_marks(np.asarray(picture.image))
        assert marks is not None
        assert marks.frame == number
        assert marks.captured_at_s == pytest.approx(picture.captured_at_s, abs=1e-4)
        assert picture.captured_at_s == pytest.approx(1000.0 + number / 10)


@pytest.mark.parametrize("size", [(160, 120), (640, 480), (1920, 1080)])
def test_it_has_the_wanted_size_and_readable_marks(size: tuple[int, int]) -> None:
    (picture,) = images({"width": size[0], "height": size[1]}, 1)
    image = np.asarray(picture.image)
    assert image.shape == (size[1], size[0], 3)
    assert read_marks(image) is not None


def test_it_moves_visibly_from_picture_to_picture() -> None:
    first, second = (np.asarray(picture.image).astype(int) for picture in images({"fps": 10}, 2))
    assert (np.abs(first - second).max(axis=2) > 60).sum() > 100


def test_pictures_do_not_share_memory() -> None:
    first, second = images({}, 2)
    assert not np.shares_memory(np.asarray(first.image), np.asarray(second.image))


@pytest.mark.parametrize("params", [{"fps": 0}, {"width": 100}, {"height": 481}, {"colour": "red"}])
def test_wrong_params_are_refused(params: dict[str, object]) -> None:
    with pytest.raises(ConfigError):
        build(TestPatternConfigurer, params=params)
