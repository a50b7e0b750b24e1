"""A tap of a running robot: one more viewer of a stream, on the best rung, read on a plugin's own thread."""

from __future__ import annotations

import asyncio
from collections import deque

from mosaic_core.contract.media_tap import TapCodec, TappedPicture
from mosaic_core.machines.congestion.rate_control import PictureLost
from mosaic_core.runtime.media.media_hub import MediaHub
from mosaic_core.runtime.media.tap import Tap
from mosaic_core.runtime.transport.picture_transport import PictureFeed

MAX_WAITING_BYTES = 32 * 1024 * 1024
"""Half a minute of a good picture: a disk that writes nothing for longer is broken."""
_MIME_TYPES: dict[TapCodec, str] = {"h264": "video/H264", "vp8": "video/VP8"}


class RuntimeTap(Tap):
    """Reads a stream's packets on the robot itself; a :class:`~mosaic_core.contract.media_tap.MediaTap`. The pump runs
    on the event loop, the rest on the thread of whoever opened it.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, media: MediaHub, label: str, codec: TapCodec) -> None:
        super().__init__(loop, media, label)
        self._codec: TapCodec = codec
        self._waiting: deque[TappedPicture] = deque()
        self._waiting_bytes = 0
        self._needs_key = True
        self._feed: PictureFeed | None = None
        self._pump_task: asyncio.Task[None] | None = None
        self.dropped = 0

    def next(self, timeout_s: float) -> TappedPicture | None:
        """See :class:`~mosaic_core.contract.media_tap.MediaTap`."""
        with self._came:
            if not self._came.wait_for(lambda: self._waiting or self.failure, timeout_s) or not self._waiting:
                return None
            picture = self._waiting.popleft()
            self._waiting_bytes -= len(picture.data)
            return picture

    def ask_key_frame(self) -> None:
        """See :class:`~mosaic_core.contract.media_tap.MediaTap`."""
        self._on_loop(self._ask_key_frame)

    # -- on the event loop ---------------------------------------------------------------------------------------

    def _start(self) -> None:
        feed = self._media.bind(self._viewer_id, self._label, self._failed, is_local=True)
        feed.codec_agreed(_MIME_TYPES[self._codec])
        self._feed = feed
        self._pump_task = self._loop.create_task(self._pump(feed), name=f"mosaic-tap-{self._label}")
        self._media.watch(self._viewer_id, self._label, True)

    def _close(self) -> None:
        if self._pump_task is not None:
            self._pump_task.cancel()
        super()._close()
        self._feed = None

    def _ask_key_frame(self) -> None:
        if self._feed is not None:
            self._feed.heard(PictureLost())

    async def _pump(self, feed: PictureFeed) -> None:
        while True:
            packet = await feed.next()
            captured_at_s = float(packet.pts * packet.time_base)
            self._put(TappedPicture(bytes(packet), captured_at_s, bool(packet.is_keyframe), self._codec))

    def _put(self, picture: TappedPicture) -> None:
        with self._came:
            self.failure = ""
            is_full = self._waiting_bytes + len(picture.data) > MAX_WAITING_BYTES
            self._needs_key = is_full or (self._needs_key and not picture.is_key)
            if self._needs_key:
                self.dropped += 1
                if not is_full:  # there is room again, and key frames come only to those who ask
                    self._ask_key_frame()
                return
            self._waiting.append(picture)
            self._waiting_bytes += len(picture.data)
            self._came.notify_all()
