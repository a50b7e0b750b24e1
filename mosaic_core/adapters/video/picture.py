"""Turns whatever a media handler yields into one yuv420p frame, once, however many operators watch.

Several encoders must never touch one ``VideoFrame``: PyAV rebases its time while encoding, and concurrent
``reformat`` of one bgr24 frame ends in SIGSEGV. So the picture lives in one read-only I420 array, and every track
wraps it in a frame of its own (:func:`own_frame`, 4 µs).
"""

from __future__ import annotations

from typing import Any, TypeAlias, cast

import av
import cv2
import numpy as np
from numpy.typing import NDArray

from mosaic_core.adapters.video.picture_clock import VIDEO_TIME_BASE, pts_of
from mosaic_core.contract.declared.sent_picture import TAKEN, picture_cure
from mosaic_core.contract.declared.yielded import kind_of
from mosaic_core.contract.media import Image

PixelArray: TypeAlias = NDArray[np.uint8]

_CHROMA_OF_GRAY = 128


def prepared_picture(image: Image | av.VideoFrame, captured_at_s: float) -> av.VideoFrame:
    """The picture as yuv420p with pts, prepared for all encoders on the handler's thread.

    An odd last row or column is cut off. Raises :class:`TypeError` for what is no picture.
    """
    pixels = _i420_of_frame(image) if isinstance(image, av.VideoFrame) else _i420_of_image(image)
    return _frame_around(pixels, pts_of(captured_at_s))


def exact_frame(image: object) -> av.VideoFrame:
    """A frame with exactly the pixels that a handler yielded, in its own format. Raises :class:`TypeError` for what is
    no picture, or is encoded."""
    if isinstance(image, av.VideoFrame):
        return image
    if isinstance(image, av.Packet):
        raise TypeError("a picture that is encoded already is decoded by a real operator only")
    pixels = _checked(image)
    return av.VideoFrame.from_ndarray(pixels, format="gray" if pixels.ndim == 2 else "bgr24")


def own_frame(prepared: av.VideoFrame) -> av.VideoFrame:
    """A frame for one encoder alone, around the same pixels."""
    return _frame_around(_i420_of_prepared(prepared), prepared.pts or 0)


def scaled_picture(prepared: av.VideoFrame, width: int, height: int) -> av.VideoFrame:
    """The same picture in another (even) size, or itself. Reads only; any thread."""
    if (prepared.width, prepared.height) == (width, height):
        return prepared
    planes = []
    whole = _planes(_i420_of_prepared(prepared), prepared.width, prepared.height)
    for plane, shrink in zip(whole, (1, 2, 2), strict=True):
        planes.append(cv2.resize(plane, (width // shrink, height // shrink), interpolation=cv2.INTER_AREA).ravel())
    joined = np.concatenate(planes).reshape(height * 3 // 2, width)
    return _frame_around(cast(PixelArray, joined), prepared.pts or 0)


def luma_samples(prepared: av.VideoFrame) -> PixelArray:
    """Every seventh pixel of every seventh row: enough to tell one scene from another. Reads only; any thread."""
    luma, _, _ = _planes(_i420_of_prepared(prepared), prepared.width, prepared.height)
    return np.ascontiguousarray(luma[::7, ::7])


def _planes(pixels: PixelArray, width: int, height: int) -> tuple[PixelArray, PixelArray, PixelArray]:
    """Y, U and V of a contiguous I420 array, as views."""
    flat = pixels.reshape(-1)
    luma, chroma = width * height, width * height // 4
    half = (height // 2, width // 2)
    return (
        flat[:luma].reshape(height, width),
        flat[luma : luma + chroma].reshape(half),
        flat[luma + chroma : luma + 2 * chroma].reshape(half),
    )


def _frame_around(pixels: PixelArray, pts: int) -> av.VideoFrame:
    height = pixels.shape[0] * 2 // 3
    # PyAV takes a buffer of 45 rows for a picture 28 high, not 30: it divides by 6 first.
    frame = _copied_frame(pixels, height) if height % 4 else av.VideoFrame.from_numpy_buffer(pixels, format="yuv420p")
    frame.pts = pts
    frame.time_base = VIDEO_TIME_BASE
    frame.opaque = pixels
    return frame


def _copied_frame(pixels: PixelArray, height: int) -> av.VideoFrame:
    frame = av.VideoFrame(pixels.shape[1], height, "yuv420p")
    for plane, source in zip(frame.planes, _planes(pixels, pixels.shape[1], height), strict=True):
        rows = np.frombuffer(cast(Any, plane), np.uint8).reshape(plane.height, plane.line_size)
        rows[:, : plane.width] = source
    return frame


def _i420_of_prepared(prepared: av.VideoFrame) -> PixelArray:
    pixels = cast("PixelArray | None", prepared.opaque)
    return _i420_of_frame(prepared) if pixels is None else pixels


def _i420_of_frame(frame: av.VideoFrame) -> PixelArray:
    if frame.width % 2 or frame.height % 2:
        return _i420_of_image(cast(PixelArray, frame.to_ndarray(format="bgr24")))
    return cast(PixelArray, frame.to_ndarray(format="yuv420p"))


def _checked(image: object) -> PixelArray:
    """``image`` if it is a picture; raises :class:`TypeError`."""
    cure = picture_cure(image)
    if cure is not None:
        raise TypeError(f"{TAKEN}, not {kind_of(image)}. {cure}")
    return cast(PixelArray, image)


def _i420_of_image(unchecked: object) -> PixelArray:
    image = _checked(unchecked)
    height, width = image.shape[0] & ~1, image.shape[1] & ~1
    cropped = image[:height, :width]
    if image.ndim == 3:
        return cast(PixelArray, cv2.cvtColor(np.ascontiguousarray(cropped), cv2.COLOR_BGR2YUV_I420))
    pixels = np.full((height * 3 // 2, width), _CHROMA_OF_GRAY, np.uint8)
    # COLOR_BGR2YUV_I420 makes limited-range luma (16-235) as BT.601 wants it; gray must match.
    pixels[:height] = cv2.convertScaleAbs(cropped, alpha=219 / 255, beta=16)
    return pixels
