"""The taps of a running robot: viewers on this robot that a plugin's own thread reads, of a stream on the best rung, or
of pictures before they are encoded.
"""

from __future__ import annotations

import asyncio
from abc import abstractmethod
from typing import TYPE_CHECKING, cast
from uuid import uuid4

from mosaic_core.contract.media import Captured
from mosaic_core.contract.media_tap import TapCodec, TappedImage, TappedPicture
from mosaic_core.machines.congestion.feedback import PictureLost
from mosaic_core.machines.delivery.backlog import Backlog
from mosaic_core.runtime.media.media_hub import MediaHub
from mosaic_core.runtime.threads.tap import Tap
from mosaic_core.runtime.transport.media_transport import PictureFeed

if TYPE_CHECKING:
    from mosaic_core.contract.media import Image


class CameraTap(Tap):
    """The base of the taps of one camera: a viewer on the robot itself."""

    def __init__(self, loop: asyncio.AbstractEventLoop, media: MediaHub, label: str) -> None:
        super().__init__(loop)
        self._media = media
        self._label = label
        self._viewer_id = f"tap-{uuid4().hex}"

    @abstractmethod
    def _start(self) -> None:
        """Watch the camera; event loop."""

    def _close(self) -> None:
        self._media.leave(self._viewer_id)

    def _open(self) -> None:
        if self._label in self._media.cameras():
            self._start()
        else:
            self._failed("channel.unknown_label")


MAX_WAITING_BYTES = 32 * 1024 * 1024
"""Half a minute of a good picture: a disk that writes nothing for longer is broken."""
_MIME_TYPES: dict[TapCodec, str] = {"h264": "video/H264", "vp8": "video/VP8"}


class RuntimeTap(CameraTap):
    """Reads a stream's packets on the robot itself; a :class:`~mosaic_core.contract.media_tap.MediaTap`. The pump runs
    on the event loop, the rest on the thread of whoever opened it.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, media: MediaHub, label: str, codec: TapCodec) -> None:
        super().__init__(loop, media, label)
        self._codec: TapCodec = codec
        self._waiting: Backlog[TappedPicture] = Backlog(MAX_WAITING_BYTES)
        self._needs_key = True
        self._feed: PictureFeed | None = None
        self._pump_task: asyncio.Task[None] | None = None
        self.dropped = 0

    def next(self, timeout_s: float) -> TappedPicture | None:
        """See :class:`~mosaic_core.contract.media_tap.MediaTap`."""
        with self._came:
            self._came.wait_for(lambda: len(self._waiting) or self.failure, timeout_s)
            return self._waiting.take()

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
            is_full = self._waiting.size_bytes + len(picture.data) > MAX_WAITING_BYTES
            self._needs_key = is_full or (self._needs_key and not picture.is_key)
            if self._needs_key:
                self.dropped += 1
                if not is_full:  # there is room again, and key frames come only to those who ask
                    self._ask_key_frame()
                return
            self._waiting.put(picture, len(picture.data))
            self._came.notify_all()


ENCODED_ONLY = "media.encoded_only"


class RuntimePictureTap(CameraTap):
    """Reads a camera's pictures on the robot itself; a :class:`~mosaic_core.contract.media_tap.PictureTap`."""

    def __init__(self, loop: asyncio.AbstractEventLoop, media: MediaHub, label: str) -> None:
        super().__init__(loop, media, label)
        self._is_asked = False
        self._image: TappedImage | None = None

    def next(self, timeout_s: float) -> TappedImage | None:
        """See :class:`~mosaic_core.contract.media_tap.PictureTap`."""
        with self._came:
            if self.failure == ENCODED_ONLY:
                self.failure = ""  # a camera may change what it yields
            self._is_asked = True
            self._came.wait_for(lambda: self._image or self.failure, timeout_s)
            self._is_asked = False
            image, self._image = self._image, None
            return image

    def _start(self) -> None:
        self._media.look(self._viewer_id, self._label, self._captured)

    def _captured(self, captured: Captured) -> None:
        """On the camera's thread; it may use its buffer again as soon as this returns."""
        if not self._is_asked:
            return
        image = _copied(captured.image)
        if image is None:
            self._failed(ENCODED_ONLY)
            return
        with self._came:
            if self._is_asked:
                self._is_asked, self._image = False, TappedImage(image, captured.captured_at_s)
                self._came.notify_all()


def _copied(image: object) -> Image | None:
    """Its pixels; ``None`` for a packet. By their methods: arrays and frames belong to libraries that not every robot
    loads."""
    if hasattr(image, "to_ndarray"):
        return cast("Image", image.to_ndarray(format="bgr24"))
    return cast("Image", image).copy() if hasattr(image, "shape") else None
