"""Single pictures: as they were captured, or an encoded key frame decoded; written as PNG."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING

from mosaic_core.contract.media_tap import TappedImage, TappedPicture

if TYPE_CHECKING:
    import av


def framed(picture: TappedImage) -> av.VideoFrame:
    """Its pixels as they are. Raises :class:`ValueError` for what is no picture of 8 bits."""
    import av

    return av.VideoFrame.from_ndarray(picture.image, format="gray" if picture.image.ndim == 2 else "bgr24")


def decoded(picture: TappedPicture) -> av.VideoFrame:
    """The picture of a key frame. Raises :class:`ValueError` if it can't be decoded by itself."""
    import av

    context = av.CodecContext.create(picture.codec, "r")
    context.thread_count = 1  # several would hold the picture back
    try:
        frames = [*context.decode(av.Packet(picture.data)), *context.decode(None)]
    except av.FFmpegError as error:
        raise ValueError(f"the key frame can't be decoded: {error}") from error
    if not frames:
        raise ValueError("the key frame holds no picture")
    return frames[0]


def png_of(frame: av.VideoFrame) -> bytes:
    """A PNG file of ``frame`` in its full size, 8 bits per colour."""
    import av

    context = av.CodecContext.create("png", "w")
    context.width, context.height, context.pix_fmt = frame.width, frame.height, "rgb24"
    context.time_base = Fraction(1, 1)
    still = frame.reformat(format="rgb24")
    return b"".join(bytes(packet) for packet in (*context.encode(still), *context.encode(None)))
