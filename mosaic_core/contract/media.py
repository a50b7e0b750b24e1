"""Declares the pictures and sounds that a media handler may yield, and how its pictures shall be encoded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from pydantic import Field, model_validator

from mosaic_core.contract.params import Params, unit
from mosaic_core.machines.media.rung_ladder import Preset

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
"""An ``av.Packet`` is passed on as it is. Its codec is that of its ``stream``, and packets of H.264 may come just as
``container.demux(video=0)`` gives them. A packet without a stream is of the handler's ``packet_codec``, H.264 where
that names none; such H.264 has start codes (Annex B), and its parameter sets before every key frame."""

PacketCodec: TypeAlias = Literal["vp8", "h264"]
Codec: TypeAlias = Literal["auto", "vp8", "h264"]
Encoder: TypeAlias = Literal[
    "auto", "h264_nvenc", "h264_qsv", "h264_vaapi", "h264_v4l2m2m", "h264_amf", "libx264",
    "vp8_vaapi", "vp8_v4l2m2m", "libvpx",
]  # fmt: skip

_VP8_ENCODERS = ("vp8_vaapi", "vp8_v4l2m2m", "libvpx")


class EncodingParams(Params):
    """The params of every connector that sends video: derive your ``Params`` from it and set
    ``self.encoding = params`` in the handler."""

    codec: Codec = Field(
        default="auto",
        description="Codec to prefer; an operator who does not have it gets the other one. "
        "`auto`: that of the named `encoder`, else that of a source that is encoded already, else H.264 where only "
        "that is encoded in hardware, else VP8.",
    )
    encoder: Encoder = Field(
        default="auto",
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
        description="Most that one operator is sent, with the copies that cover loss. Default: 0.085 bit (`drive`) or "
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
        if self.least_bps < self.min_bitrate_bps and "min_bitrate_bps" in self.model_fields_set:
            raise ValueError("max_bitrate_bps is below min_bitrate_bps")
        return self

    @model_validator(mode="after")
    def _of_one_codec(self) -> EncodingParams:
        made = self.encoders_codec
        if made is not None and self.codec not in ("auto", made):
            raise ValueError(f"encoder {self.encoder} makes {made}, not {self.codec}: leave out one of the two")
        return self

    @property
    def least_bps(self) -> int:
        """``min_bitrate_bps``; a lower ``max_bitrate_bps`` takes the default minimum with it."""
        return min(self.min_bitrate_bps, self.max_bitrate_bps or self.min_bitrate_bps)

    @property
    def encoders_codec(self) -> PacketCodec | None:
        """What the named encoder makes; ``None``: none is named."""
        if self.encoder == "auto":
            return None
        return "vp8" if self.encoder in _VP8_ENCODERS else "h264"
