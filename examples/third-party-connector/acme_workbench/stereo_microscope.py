"""The ``stereo-microscope`` connector: one device that is three things, a camera for each eye and a light.

Each has a label, a card, counters and viewers of its own; they all begin with the connector's label.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar

from pydantic import Field

from acme_workbench.lamp import Lamp, LampParams
from acme_workbench.newest_picture import MADE_UP, NewestPicture, NewestPictureParams
from mosaic_core import Configurer, Handler

EYES = ("left", "right")


class StereoMicroscopeParams(NewestPictureParams, LampParams):
    folder: Path = Field(
        description="Where the folders `left` and `right` with pictures are. `made-up`: pictures that nobody took.",
        examples=["/var/lib/microscope"],
    )


class StereoMicroscopeConfigurer(Configurer[StereoMicroscopeParams]):
    """A microscope with two cameras and a light."""

    connector_type = "stereo-microscope"
    trial: ClassVar[dict[str, Any] | None] = {"folder": "made-up", "led": "made-up"}

    def configure(self) -> Sequence[Handler]:
        eyes = [NewestPicture(f"{self.label}_{eye}", self._params_of(eye)) for eye in EYES]
        return [*eyes, Lamp(f"{self.label}_light", self.params)]

    def _params_of(self, eye: str) -> NewestPictureParams:
        folder = self.params.folder
        return self.params if folder == MADE_UP else self.params.model_copy(update={"folder": folder / eye})
