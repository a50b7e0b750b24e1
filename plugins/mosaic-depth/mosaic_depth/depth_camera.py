"""Declares what a depth camera is: whatever gives a colour and a depth picture that lie over each other."""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass
from typing import Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from mosaic_core.contract.media import Image

Depth: TypeAlias = NDArray[np.floating[Any]]

MOST_PX = 4096
"""The longest side of a picture: what is larger is a fault of the driver."""


@dataclass(frozen=True, slots=True)
class Intrinsics:
    """The pinhole behind both pictures, in pixels: focal lengths, and where the optical axis meets the picture.

    Pictures of a lens that bends lines must be straightened before.
    """

    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float


@dataclass(frozen=True, slots=True, eq=False)
class DepthFrame:
    """What a depth camera took at one moment. A pixel of both pictures looks along the same ray."""

    colour: Image
    """``uint8`` (height, width, 3), BGR."""
    depth_m: Depth
    """Floats (height, width): metres along the optical axis; 0, less or NaN where it is not known."""
    intrinsics: Intrinsics
    captured_at_s: float | None = None
    """On the clock of ``time.monotonic()``; ``None``: now."""


class DepthCamera(Protocol):
    """An open depth camera. Made by calling its class with :class:`~mosaic_depth.DepthCameraParams`.

    All three calls may come from different threads, but never two at once. They raise :class:`OSError`, or
    :class:`~mosaic_core.DeviceGone` with a cure, for a camera that is not there or no longer: it is opened anew.
    """

    def next(self, timeout_s: float) -> DepthFrame | None:
        """The next pictures, which nobody writes to any more. Waits at most ``timeout_s``; ``None``: none came."""
        ...

    def close(self) -> None:
        """Let the device go. Called once; after an error, too."""
        ...


def fault_of(frame: DepthFrame) -> str:
    """What makes ``frame`` useless; empty: nothing."""
    colour, depth = frame.colour, frame.depth_m
    if colour.dtype != np.uint8 or colour.ndim != 3 or colour.shape[2] != 3:
        return f"a colour picture of {colour.dtype} {colour.shape}, not uint8 (height, width, 3)"
    if depth.dtype.kind != "f" or depth.shape != colour.shape[:2]:
        return f"a depth picture of {depth.dtype} {depth.shape}, not floats {colour.shape[:2]} as the colour"
    if not 2 <= min(depth.shape) <= max(depth.shape) <= MOST_PX:
        return f"pictures of {depth.shape[1]}x{depth.shape[0]} pixels"
    values = frame.intrinsics
    if not all(map(math.isfinite, astuple(values))) or values.fx_px <= 0 or values.fy_px <= 0:
        return f"{values}, which is no pinhole"
    return ""
