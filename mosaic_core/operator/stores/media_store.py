"""The store of one camera: frames as they come, newest first."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from typing import TYPE_CHECKING, Any

from mosaic_core.operator.stores.mosaic_store import MosaicStore
from mosaic_core.operator.stores.robot_connector import RobotConnector
from mosaic_core.words.errors import MosaicError

if TYPE_CHECKING:
    import av

    from mosaic_core.contract.media import Image


class MediaStreamStore(MosaicStore):
    """Receives one camera's pictures. While this store exists the robot sends them; without any it captures nothing."""

    def __init__(self, robot_connector: RobotConnector) -> None:
        super().__init__(robot_connector)
        self.latest_frame: av.VideoFrame | None = None
        self.received_frames = 0
        self._arrived = asyncio.Event()

    async def next_frame(self, timeout_s: float = 10.0) -> av.VideoFrame:
        """A frame that was not there yet at the time of the call; raises :class:`TimeoutError`, or
        :class:`ConnectionFailed` where none can come (``channel.unknown_label``, ``media.no_line``)."""
        seen = self.received_frames
        async with asyncio.timeout(timeout_s):
            return await self._frame_after(seen)

    async def next_image(self, timeout_s: float = 10.0) -> Image:
        """The same as ``uint8`` (height, width, 3) in BGR order."""
        image: Any = (await self.next_frame(timeout_s)).to_ndarray(format="bgr24")
        return image  # type: ignore[no-any-return]

    async def frames(self) -> AsyncIterator[av.VideoFrame]:
        """Frames for ever; a slow reader misses some and always gets the newest. Raises as :meth:`next_frame`."""
        seen = -1
        while True:
            frame = await self._frame_after(seen)
            seen = self.received_frames
            yield frame

    async def _frame_after(self, seen: int) -> av.VideoFrame:
        while self.received_frames == seen or self.latest_frame is None:
            self._raise_if_hopeless()
            self._arrived.clear()
            await self._arrived.wait()
        return self.latest_frame

    def failed(self, error: MosaicError, nearest: str | None = None) -> None:
        super().failed(error, nearest)
        self._arrived.set()

    def frame_arrived(self, frame: av.VideoFrame) -> None:
        """Called by the connection with every frame."""
        self.latest_frame = frame
        self.received_frames += 1
        self._arrived.set()
