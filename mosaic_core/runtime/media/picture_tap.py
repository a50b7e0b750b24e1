"""A tap of a running robot that gets pictures before they are encoded: a viewer that a plugin's own thread reads."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, cast

from mosaic_core.contract.media import Captured
from mosaic_core.contract.media_tap import TappedImage
from mosaic_core.runtime.media.media_hub import MediaHub
from mosaic_core.runtime.media.tap import Tap

if TYPE_CHECKING:
    from mosaic_core.contract.media import Image

ENCODED_ONLY = "media.encoded_only"


class RuntimePictureTap(Tap):
    """Reads a camera's pictures on the robot itself; a :class:`~mosaic_core.contract.media_tap.PictureTap`."""

    def __init__(self, loop: asyncio.AbstractEventLoop, media: MediaHub, label: str) -> None:
        super().__init__(loop, media, label)
        self._is_asked = False
        self._image: TappedImage | None = None

    def next(self, timeout_s: float) -> TappedImage | None:
        """See :class:`~mosaic_core.contract.media_tap.PictureTap`."""
        with self._came:
            if self.failure == ENCODED_ONLY:
                self.failure = ""  # a camera may change what it yields
            self._is_asked = True
            self._came.wait_for(lambda: self._image or self.failure, timeout_s)
            self._is_asked = False
            image, self._image = self._image, None
            return image

    def _start(self) -> None:
        self._media.look(self._viewer_id, self._label, self._captured)

    def _captured(self, captured: Captured) -> None:
        """On the camera's thread; it may use its buffer again as soon as this returns."""
        if not self._is_asked:
            return
        image = _copied(captured.image)
        if image is None:
            self._failed(ENCODED_ONLY)
            return
        with self._came:
            if self._is_asked:
                self._is_asked, self._image = False, TappedImage(image, captured.captured_at_s)
                self._came.notify_all()


def _copied(image: object) -> Image | None:
    """Its pixels; ``None`` for a packet. By their methods: arrays and frames belong to libraries that not every robot
    loads."""
    if hasattr(image, "to_ndarray"):
        return cast("Image", image.to_ndarray(format="bgr24"))
    return cast("Image", image).copy() if hasattr(image, "shape") else None
