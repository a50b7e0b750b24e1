"""From a numpy picture to what an encoder takes: our one conversion beside the naïve two."""

from __future__ import annotations

import time
from collections.abc import Callable

import av

from mosaic_core.adapters.video.picture import own_frame, prepared_picture
from video_bench.scene import Image


def ours_ms(pictures: list[Image]) -> float:
    return _ms(pictures, lambda image: own_frame(prepared_picture(image, 1.0)))


def naive_ms(pictures: list[Image]) -> float:
    return _ms(pictures, lambda image: av.VideoFrame.from_ndarray(image, format="bgr24").reformat(format="yuv420p"))


def _ms(pictures: list[Image], convert: Callable[[Image], object]) -> float:
    began_s = time.perf_counter()
    for image in pictures:
        convert(image)
    return (time.perf_counter() - began_s) / len(pictures) * 1000
