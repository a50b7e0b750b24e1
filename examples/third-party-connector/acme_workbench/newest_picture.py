"""The ``newest-picture`` camera: whatever picture another program, such as a microscope's, wrote last into a folder."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from mosaic_core import DeviceGone, EncodingParams, MediaTrackConfigurer, MediaTrackHandler, unit

MADE_UP = Path("made-up")


class NewestPictureParams(EncodingParams):
    folder: Path = Field(
        description="Where the pictures are. `made-up`: a picture that nobody took.", examples=["/var/lib/microscope"]
    )
    pattern: str = Field(default="*.png", description="Which files are pictures.")
    fps: float = Field(
        default=2.0, gt=0, le=30, description="Looks into the folder per second.", json_schema_extra=unit("Hz")
    )


class NewestPicture(MediaTrackHandler):
    """Runs only while somebody watches, on a thread of its own: reading files may take its time."""

    def __init__(self, label: str, params: NewestPictureParams) -> None:
        super().__init__(label)
        self.encoding, self.params = params, params

    def frames(self) -> Iterator[NDArray[np.uint8]]:
        for _ in self.every(1 / self.params.fps):
            image = self._look()
            if image is not None:  # one that is still being written is looked at again
                yield image

    def _look(self) -> NDArray[np.uint8] | None:
        if self.params.folder == MADE_UP:
            return np.full((120, 160, 3), 90, np.uint8)
        image = cv2.imread(str(self._newest()), cv2.IMREAD_COLOR)
        return None if image is None else image.astype(np.uint8)

    def _newest(self) -> Path:
        found = sorted(self.params.folder.glob(self.params.pattern), key=lambda path: path.stat().st_mtime)
        if not found:
            raise DeviceGone(f"no {self.params.pattern} in {self.params.folder}", "start the program that writes them")
        return found[-1]


class NewestPictureConfigurer(MediaTrackConfigurer[NewestPictureParams]):
    """The newest picture of a folder."""

    connector_type = "newest-picture"
    trial: ClassVar[dict[str, Any] | None] = {"folder": "made-up"}

    def configure(self) -> NewestPicture:
        return NewestPicture(self.label, self.params)
