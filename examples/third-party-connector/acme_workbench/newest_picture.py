"""The ``newest-picture`` camera: whatever picture another program, such as a microscope's, wrote last into a folder."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from mosaic_core import DeviceGone, EncodingParams, MediaTrackConfigurer, MediaTrackHandler


class NewestPictureParams(EncodingParams):
    folder: Path = Field(description="Where the pictures are.", examples=["/var/lib/microscope"])
    pattern: str = Field(default="*.png", description="Which files are pictures.")
    fps: float = Field(default=2.0, gt=0, le=30, description="Looks into the folder per second.")


class NewestPicture(MediaTrackHandler):
    """Runs only while somebody watches, on a thread of its own: reading files may take its time."""

    def __init__(self, label: str, params: NewestPictureParams) -> None:
        super().__init__(label)
        self.encoding, self.params = params, params

    def frames(self) -> Iterator[NDArray[np.uint8]]:
        for _ in self.every(1 / self.params.fps):
            image = cv2.imread(str(self._newest()), cv2.IMREAD_COLOR)
            if image is not None:  # one that is still being written is looked at again
                yield image.astype(np.uint8)

    def _newest(self) -> Path:
        found = sorted(self.params.folder.glob(self.params.pattern), key=lambda path: path.stat().st_mtime)
        if not found:
            raise DeviceGone(f"no {self.params.pattern} in {self.params.folder}", "start the program that writes them")
        return found[-1]


class NewestPictureConfigurer(MediaTrackConfigurer[NewestPictureParams]):
    """The newest picture of a folder."""

    connector_type = "newest-picture"

    def configure(self) -> NewestPicture:
        return NewestPicture(self.label, self.params)
