"""Sound on its way through handlers: what a microphone yields, and what a loudspeaker is given."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from pydantic import Field

from mosaic_core.contract.params import Params, unit

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Samples: TypeAlias = "NDArray[np.int16]"
"""``int16``, shape (n, channels)."""


@dataclass(frozen=True, slots=True)
class Sound:
    """A piece of sound, usually 10 to 60 ms.

    ``captured_at_s``: seconds of the robot's monotonic clock (``time.monotonic()``) at its first sample.
    """

    samples: Samples
    rate_hz: int
    captured_at_s: float

    @property
    def duration_s(self) -> float:
        """How long it lasts, in seconds."""
        return len(self.samples) / self.rate_hz


class SoundEncoding(Params):
    """The params of every connector that sends sound: derive your ``Params`` from it and set
    ``self.encoding = params`` in the handler."""

    bitrate_bps: int = Field(
        default=40_000,
        ge=8_000,
        le=256_000,
        description="Opus bit rate; 24000 is clear speech, 96000 is music.",
        json_schema_extra=unit("bit/s"),
    )
