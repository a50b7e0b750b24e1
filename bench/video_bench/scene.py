"""Pictures to encode: a slow pan over texture with the noise of a sensor, made before anything is measured."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
MADE = 90


def scene(width: int, height: int) -> list[Image]:
    """BGR pictures that loop without a jump."""
    chance = np.random.default_rng(1)
    coarse = chance.integers(0, 255, (90, 160, 3), dtype=np.uint8)
    texture = cv2.resize(coarse, (width * 2, height * 2), interpolation=cv2.INTER_CUBIC).astype(np.int16)
    noise = chance.integers(-6, 7, (5, height, width, 3), dtype=np.int16)
    pictures = []
    for number in range(MADE):
        angle = 2 * np.pi * number / MADE
        left, top = int(width / 8 * (1 + np.sin(angle))), int(height / 8 * (1 + np.cos(angle)))
        part = texture[top : top + height, left : left + width] + noise[number % len(noise)]
        pictures.append(np.clip(part, 0, 255).astype(np.uint8))
    return pictures
