"""Flip, rotation and size."""

import numpy as np
import pytest

from mosaic_camera.transform import fitted_size, scaled, turned

CORNERS = np.array([[[1], [2]], [[3], [4]]], dtype=np.uint8)


def corners(image: np.ndarray) -> list[int]:
    return [int(v) for v in image[..., 0].ravel()]


@pytest.mark.parametrize(
    ("flip", "rotation", "expected"),
    [
        ("none", 0, [1, 2, 3, 4]),
        ("horizontal", 0, [2, 1, 4, 3]),
        ("vertical", 0, [3, 4, 1, 2]),
        ("both", 0, [4, 3, 2, 1]),
        ("none", 90, [3, 1, 4, 2]),
        ("none", 180, [4, 3, 2, 1]),
        ("none", 270, [2, 4, 1, 3]),
        ("horizontal", 90, [4, 2, 3, 1]),
    ],
)
def test_first_flipped_then_rotated_clockwise(flip: str, rotation: int, expected: list[int]) -> None:
    image = turned(CORNERS, flip, rotation)  # type: ignore[arg-type]
    assert corners(image) == expected
    assert image.flags.c_contiguous


def test_a_picture_that_needs_nothing_is_not_copied() -> None:
    assert turned(CORNERS, "none", 0) is CORNERS
    assert scaled(CORNERS, None, None) is CORNERS
    assert scaled(CORNERS, 2, 2) is CORNERS


@pytest.mark.parametrize(
    ("wanted", "expected"),
    [((None, None), (1920, 1080)), ((640, 480), (640, 480)), ((640, None), (640, 360)), ((None, 361), (642, 360))],
)
def test_the_missing_side_follows_and_both_are_even(wanted: tuple[int | None, int | None], expected: object) -> None:
    assert fitted_size(1920, 1080, *wanted) == expected


def test_scaling_keeps_the_content() -> None:
    image = np.zeros((100, 200, 3), dtype=np.uint8)
    image[:, 100:] = 200
    smaller = scaled(image, 100, None)
    assert smaller.shape == (50, 100, 3)
    assert smaller.dtype == np.uint8
    assert smaller[:, :48].max() == 0
    assert smaller[:, 52:].min() == 200
