"""Makes BGR or gray pictures of ROS' images, with one copy at most: none where the message has what is needed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from mosaic_ros2.conversion.parts import Ros

Rows: TypeAlias = NDArray[Any]

MAX_PIXELS = 64_000_000
_DIRECT: dict[str, tuple[str, int, int | None]] = {
    "bgr8": ("u1", 3, None), "8UC3": ("u1", 3, None), "mono8": ("u1", 1, None), "8UC1": ("u1", 1, None),
    "rgb8": ("u1", 3, cv2.COLOR_RGB2BGR), "rgba8": ("u1", 4, cv2.COLOR_RGBA2BGR),
    "bgra8": ("u1", 4, cv2.COLOR_BGRA2BGR),
    "8UC4": ("u1", 4, cv2.COLOR_BGRA2BGR),
    "yuv422": ("u1", 2, cv2.COLOR_YUV2BGR_UYVY), "uyvy": ("u1", 2, cv2.COLOR_YUV2BGR_UYVY),
    "yuv422_yuy2": ("u1", 2, cv2.COLOR_YUV2BGR_YUY2), "yuyv": ("u1", 2, cv2.COLOR_YUV2BGR_YUY2),
    "bayer_rggb8": ("u1", 1, cv2.COLOR_BayerRGGB2BGR), "bayer_bggr8": ("u1", 1, cv2.COLOR_BayerBGGR2BGR),
    "bayer_gbrg8": ("u1", 1, cv2.COLOR_BayerGBRG2BGR), "bayer_grbg8": ("u1", 1, cv2.COLOR_BayerGRBG2BGR),
    "rgb16": ("u2", 3, cv2.COLOR_RGB2BGR), "bgr16": ("u2", 3, None), "16UC3": ("u2", 3, None),
    "mono16": ("u2", 1, None),
    "bayer_rggb16": ("u2", 1, cv2.COLOR_BayerRGGB2BGR), "bayer_bggr16": ("u2", 1, cv2.COLOR_BayerBGGR2BGR),
    "bayer_gbrg16": ("u2", 1, cv2.COLOR_BayerGBRG2BGR), "bayer_grbg16": ("u2", 1, cv2.COLOR_BayerGRBG2BGR),
}  # fmt: skip
"""sensor_msgs/image_encodings.hpp: the type of a number, numbers of a pixel, and OpenCV's conversion to BGR."""
_DEPTHS = {"16UC1": ("u2", 1000.0), "32FC1": ("f4", 1.0)}
"""REP-118: millimetres in whole numbers, metres in floats."""


def picture_of(message: Ros, depth_max_m: float) -> NDArray[np.uint8]:
    """The picture of a ``sensor_msgs/Image``, (height, width, 3) BGR or (height, width) gray. Distances become gray:
    white at 0, black from ``depth_max_m`` on and where nothing was measured. Raises :class:`ValueError`."""
    encoding = message["encoding"]
    depth = _DEPTHS.get(encoding)
    if depth is not None:
        return _of_depth(_rows(message, depth[0], 1), depth_max_m * depth[1])
    known = _DIRECT.get(encoding)
    if known is None:
        raise ValueError(
            f"the encoding {encoding[:40]!r} is not known; publish rgb8, bgr8, mono8 or a compressed image"
        )
    dtype, channels, conversion = known
    rows = _rows(message, dtype, channels)
    if dtype == "u2":
        rows = cv2.convertScaleAbs(rows, alpha=1 / 257)
    return rows if conversion is None else cv2.cvtColor(np.ascontiguousarray(rows), conversion)  # type: ignore[return-value]


def _rows(message: Ros, dtype: str, channels: int) -> Rows:
    """The numbers of the picture, as they lie in the message."""
    height, width, step, data = message["height"], message["width"], message["step"], message["data"]
    if not 0 < height * width <= MAX_PIXELS:
        raise ValueError(f"{width}×{height} is no size of a picture")
    kind = np.dtype((">" if message["is_bigendian"] and dtype != "u1" else "<") + dtype)
    wanted = width * channels * kind.itemsize
    if step < wanted or len(data) < step * (height - 1) + wanted:
        raise ValueError(f"{len(data)} bytes in rows of {step} are no {width}×{height} of {message['encoding']}")
    shape = (height, width) if channels == 1 else (height, width, channels)
    strides = (step, channels * kind.itemsize, kind.itemsize)[: len(shape)]
    rows: Rows = np.ndarray(shape, kind, buffer=data, strides=strides)
    return rows if kind.isnative or kind.itemsize == 1 else rows.astype(kind.newbyteorder("="))


def _of_depth(rows: Rows, farthest: float) -> NDArray[np.uint8]:
    shares = np.nan_to_num(rows, nan=0.0, posinf=0.0, neginf=0.0) if rows.dtype.kind == "f" else rows
    near: Any = cv2.convertScaleAbs(shares, alpha=-255.0 / farthest, beta=255.0)
    near[(shares <= 0) | (shares >= farthest)] = 0
    return near  # type: ignore[no-any-return]


def decompressed(message: Ros) -> NDArray[np.uint8]:
    """The picture of a ``sensor_msgs/CompressedImage`` in JPEG or PNG. Raises :class:`ValueError`."""
    kind = message["format"]
    if "compressedDepth" in kind:
        raise ValueError("compressedDepth is not read: subscribe to the topic without this ending")
    found: Any = cv2.imdecode(message["data"], cv2.IMREAD_COLOR) if len(message["data"]) else None
    if found is None:
        raise ValueError(f"no picture in {len(message['data'])} bytes of format {kind[:40]!r}; JPEG and PNG are read")
    return found  # type: ignore[no-any-return]


READERS: dict[str, Callable[[Ros, float], NDArray[np.uint8]]] = {
    "sensor_msgs/msg/Image": picture_of,
    "sensor_msgs/msg/CompressedImage": lambda message, depth_max_m: decompressed(message),
}
"""By the type of ROS."""
