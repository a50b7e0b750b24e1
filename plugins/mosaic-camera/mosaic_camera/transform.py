"""Flip, rotation and size of a picture: for cameras that hang upside down. Pure."""

from __future__ import annotations

from typing import Literal, TypeAlias

import numpy as np

from mosaic_core.contract.media import Image

Flip: TypeAlias = Literal["none", "horizontal", "vertical", "both"]
Rotation: TypeAlias = Literal[0, 90, 180, 270]


def fitted_size(width: int, height: int, wanted_width: int | None, wanted_height: int | None) -> tuple[int, int]:
    """The size to scale to; with only one side wanted the other follows. Even, as video encoders need it."""
    if wanted_width is None and wanted_height is None:
        return width, height
    new_width = wanted_width or round(width * (wanted_height or height) / height)
    new_height = wanted_height or round(height * new_width / width)
    return max(2, new_width // 2 * 2), max(2, new_height // 2 * 2)


def turned(image: Image, flip: Flip, rotation_deg: Rotation) -> Image:
    """First flipped, then rotated clockwise; the same array if there is nothing to do."""
    if flip == "none" and rotation_deg == 0:
        return image
    if flip in ("horizontal", "both"):
        image = image[:, ::-1]
    if flip in ("vertical", "both"):
        image = image[::-1]
    return np.ascontiguousarray(np.rot90(image, k=-rotation_deg // 90))


def scaled(image: Image, wanted_width: int | None, wanted_height: int | None) -> Image:
    """Scaled to the wanted size; the same array if it already has it."""
    height, width = image.shape[:2]
    size = fitted_size(width, height, wanted_width, wanted_height)
    if size == (width, height):
        return image
    import cv2

    shrinks = size[0] < width
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA if shrinks else cv2.INTER_LINEAR), np.uint8)
