"""Taps: the pictures of another connector of the same robot, encoded for those who record or forward them, or as they
were captured for those who look at them.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Literal, Protocol, Self, TypeAlias

if TYPE_CHECKING:
    from mosaic_core.contract.media import Image

TapCodec: TypeAlias = Literal["h264", "vp8"]


@dataclass(frozen=True, slots=True)
class TappedPicture:
    """An encoded picture of a tapped camera. H.264 comes with start codes (Annex B) and its parameter sets before every
    key frame.

    ``captured_at_s``: seconds of the robot's monotonic clock; later than that of the picture before.
    """

    data: bytes
    captured_at_s: float
    is_key: bool
    codec: TapCodec


class MediaTap(Protocol):
    """The packets of one camera, tapped on the robot. Open while it is entered; the camera runs for it alone if nobody
    else watches. Starts with a key frame, and goes on at a key frame when pictures had to be dropped. For one thread at
    a time.
    """

    @property
    def dropped(self) -> int:
        """Pictures that were lost because :meth:`next` was not called for too long."""

    @property
    def failure(self) -> str:
        """The ``media.*`` or ``channel.*`` code why no picture can come; empty while one may."""

    def next(self, timeout_s: float) -> TappedPicture | None:
        """Wait for the next picture; ``None`` when ``timeout_s`` is over. Raises nothing."""

    def ask_key_frame(self) -> None:
        """Let a key frame come soon, where the source can make one; throttled, and one for all viewers. Any thread."""

    def __enter__(self) -> Self: ...
    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


@dataclass(frozen=True, slots=True, eq=False)
class TappedImage:
    """A picture of a tapped camera as it was captured. ``image``: ``uint8``, (height, width, 3) in BGR order, or
    (height, width) for gray; a copy that is the reader's own. ``captured_at_s``: seconds of the robot's monotonic
    clock."""

    image: Image
    captured_at_s: float


class PictureTap(Protocol):
    """The pictures of one camera, tapped on the robot. Open while it is entered; the camera runs for it alone if nobody
    else watches. Only pictures that are asked for are copied, so that a slow reader costs little and always gets a
    fresh one. For one thread at a time.
    """

    @property
    def failure(self) -> str:
        """The ``media.*`` or ``channel.*`` code why no picture can come, ``media.encoded_only`` if the camera encodes
        by itself; empty while one may come."""

    def next(self, timeout_s: float) -> TappedImage | None:
        """Wait for the next picture that is captured from now on; ``None`` when ``timeout_s`` is over, or when none
        can come. Raises nothing."""

    def __enter__(self) -> Self: ...
    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...
