"""What a media handler may yield, and how its pictures shall be encoded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from pydantic import Field, model_validator

from mosaic_core.contract.params import Params, unit

if TYPE_CHECKING:
    import av
    import numpy as np
    from numpy.typing import NDArray

Image: TypeAlias = "NDArray[np.uint8]"
"""``uint8``, shape (height, width, 3) in BGR order as OpenCV has it, or (height, width) for gray."""


@dataclass(frozen=True, slots=True)
class Captured:
    """A picture with the time it was taken: seconds of the robot's monotonic clock (``time.monotonic()``)."""

    image: Image | av.VideoFrame | av.Packet[Any]
    captured_at_s: float


Picture: TypeAlias = "Image | Captured | av.VideoFrame | av.Packet[Any]"
"""An ``av.Packet`` is passed on as it is. Its codec is that of its ``stream``; a packet without one is H.264. H.264
packets carry start codes (Annex B), and their parameter sets before every key frame."""

Codec: TypeAlias = Literal["auto", "vp8", "h264"]
Preset: TypeAlias = Literal["drive", "inspect"]


class EncodingParams(Params):
    """The params of every connector that sends video: derive your ``Params`` from it and set
    ``self.encoding = params`` in the handler."""

    codec: Codec = Field(
        default="auto",
        description="Codec to prefer; an operator who does not have it gets the other one. "
        "`auto`: VP8, but H.264 where the source has it already.",
    )
    encoder: str = Field(
        default="auto",
        min_length=1,
        description="Encoder by libav's name, as `mosaic doctor encoders` lists them; `auto`: the best that works.",
    )
    preset: Preset = Field(
        default="drive",
        description="`drive`: least latency, fluid motion first; `inspect`: sharp pictures first.",
    )
    max_bitrate_bps: int | None = Field(
        default=None,
        ge=100_000,
        le=50_000_000,
        description="Most that one operator is sent, with the copies that cover loss. Default: 0.07 bit (`drive`) or "
        "0.12 bit (`inspect`) per pixel, 30 times a second, and as much again of copies.",
        json_schema_extra=unit("bit/s"),
    )
    min_bitrate_bps: int = Field(
        default=150_000,
        ge=50_000,
        le=50_000_000,
        description="Least that one operator is sent, however bad the link.",
        json_schema_extra=unit("bit/s"),
    )
    rungs: int = Field(
        default=3,
        ge=1,
        le=4,
        description="Sizes and rates to choose from for each operator's link; 1: always the full picture.",
    )

    @model_validator(mode="after")
    def _ordered(self) -> EncodingParams:
        if self.max_bitrate_bps is not None and self.max_bitrate_bps < self.min_bitrate_bps:
            raise ValueError("max_bitrate_bps is below min_bitrate_bps")
        return self
