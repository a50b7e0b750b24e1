"""What a media handler may yield."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    import av
    import numpy as np
    from numpy.typing import NDArray

Image: TypeAlias = "NDArray[np.uint8]"
"""``uint8``, shape (height, width, 3) in BGR order as OpenCV has it, or (height, width) for gray."""


@dataclass(frozen=True, slots=True)
class Captured:
    """A picture with the time it was taken: seconds of the robot's monotonic clock (``time.monotonic()``)."""

    image: Image | av.VideoFrame
    captured_at_s: float


Picture: TypeAlias = "Image | Captured | av.VideoFrame | av.Packet[Any]"
