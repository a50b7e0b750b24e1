"""Single pictures out of key frames."""

from __future__ import annotations

from typing import Any

import av
import numpy as np
import pytest

from mosaic_camera.marks import read_marks
from mosaic_core.contract.media_tap import TappedPicture
from mosaic_recorder.stills import decoded, png_of


@pytest.mark.parametrize("codec", ["h264", "vp8"])
def test_a_key_frame_becomes_a_png_of_its_full_size(studio: Any, codec: str) -> None:
    png = png_of(decoded(studio.encoded(12, codec, (640, 480), key_every=10)[10]))
    assert png.startswith(b"\x89PNG\r\n")
    still = next(av.CodecContext.create("png", "r").decode(av.Packet(png)).__iter__())
    image = still.to_ndarray(format="bgr24")  # type: ignore[union-attr]
    assert image.shape == (480, 640, 3)
    mark = read_marks(np.asarray(image, dtype=np.uint8))
    assert mark is not None
    assert mark.frame == 10


@pytest.mark.parametrize("codec", ["h264", "vp8"])
def test_a_picture_that_needs_others_or_is_none_is_refused(studio: Any, codec: str) -> None:
    for data in (studio.encoded(3, codec)[2].data, b"", b"garbage" * 20):
        with pytest.raises(ValueError, match="key frame"):
            decoded(TappedPicture(data, 0.0, True, codec))  # type: ignore[arg-type]
