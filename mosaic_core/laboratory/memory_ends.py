"""Carries what travels over a peer connection in memory: messages on channels, pictures, voices."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from mosaic_core.contract.media import Captured
from mosaic_core.contract.sound import Sound
from mosaic_core.laboratory.impairment import Impairment
from mosaic_core.laboratory.memory_impairment import LatePictures, MessageFlow
from mosaic_core.machines.media.first_frame import ReceivedSoFar
from mosaic_core.runtime.transport.media_transport import HeardSound, PictureFeed
from mosaic_core.words.errors import ConnectionFailed

if TYPE_CHECKING:
    import av


class Cable(Protocol):
    """The connection that something belongs to."""

    is_cut: bool
    lost_labels: set[str]
    impairment: Impairment


@dataclass(frozen=True, slots=True)
class MemoryFrame:
    """A picture as it arrives at the operator: exactly what the handler yielded, and when it was captured. What a test
    reads of an ``av.VideoFrame`` it reads of this one, too; ``next_image()`` of the store gives BGR of either."""

    image: Any
    """As it was yielded: an array, or what PyAV has."""
    captured_at_s: float
    """Of the robot's monotonic clock."""

    @property
    def width(self) -> int:
        """In pixels."""
        return self._video_frame().width

    @property
    def height(self) -> int:
        """In pixels."""
        return self._video_frame().height

    def to_ndarray(self, format: str = "bgr24") -> Any:
        """The picture as ``uint8`` (height, width, 3) in BGR order, or in another format of PyAV's; a copy.

        Raises :class:`TypeError` for what is no picture, as a robot would, and for one that is encoded already: nothing
        decodes it in memory, only over real WebRTC.
        """
        return self._video_frame().to_ndarray(format=format)

    def _video_frame(self) -> av.VideoFrame:
        from mosaic_core.adapters.video.picture import exact_frame  # only now: most tests look at no picture

        return exact_frame(self.image)


def memory_picture(captured: Captured) -> MemoryFrame:
    """Implements ``runtime.transport.PicturePreparer``: nothing is converted."""
    return MemoryFrame(captured.image, captured.captured_at_s)


class MemoryChannel:
    """An end of a data channel in memory; over a perfect network messages arrive in the loop's next turn, in order."""

    def __init__(self, link: Cable, label: str, protocol: str, is_reliable: bool, *, is_first: bool) -> None:
        self.label = label
        self.protocol = protocol
        self.is_reliable = is_reliable
        self.is_first = is_first
        self.is_open = False
        self.buffered_bytes = 0
        self.window_bytes = 1024 * 1024
        self.under_way_bytes = 0
        self.gives_way = False
        self.on_message: Callable[[bytes | str], None] | None = None
        self.on_open: Callable[[], None] | None = None
        self.on_close: Callable[[], None] | None = None
        self.on_drained: Callable[[], None] | None = None
        self.other: MemoryChannel | None = None
        self._link = link
        self.sent: MessageFlow | None = None

    def give_way(self, on: bool) -> None:
        self.gives_way = on

    def send(self, data: bytes | str) -> None:
        if not self.is_open:
            raise ConnectionFailed(f"the channel {self.label!r} is closed", code="peer.closed")
        assert self.sent is not None
        self.sent.take(data)

    def receive(self, data: bytes | str) -> None:
        if self.is_open and self.label not in self._link.lost_labels and self.on_message is not None:
            self.on_message(data)

    def opened(self) -> None:
        self.is_open = True
        if self.on_open is not None:
            self.on_open()

    def close(self) -> None:
        """Close both ends."""
        for end in (self, self.other):
            if end is not None and end.is_open:
                end.is_open = False
                if end.sent is not None:
                    end.sent.close()
                if end.on_close is not None:
                    end.on_close()


class MemoryVideo:
    """The pictures of a camera that arrive in memory; a ``runtime.transport.IncomingVideo``."""

    def __init__(self, link: Cable, feed: PictureFeed) -> None:
        self._link = link
        self._feed = feed
        self._late: LatePictures | None = None

    async def next(self) -> Any:
        if self._late is None and not self._link.impairment.is_perfect:
            self._late = LatePictures(self._link.impairment, lambda: self._link.is_cut, self._feed.next)
        if self._late is not None:
            return await self._late.next()
        while True:
            frame = await self._feed.next()
            if not self._link.is_cut:
                return frame

    async def received(self) -> ReceivedSoFar | None:
        """In memory nothing is counted."""
        return None

    def rtp_timestamp(self, frame: Any) -> int | None:
        """There is no RTP in memory."""
        return None

    def stop(self) -> None:
        if self._late is not None:
            self._late.stop()


class MemoryVoice:
    """A voice that travels in memory: ``OutgoingSound`` at the operator's end, ``IncomingSound`` at the robot's."""

    def __init__(self) -> None:
        self._waiting: asyncio.Queue[HeardSound | None] = asyncio.Queue(maxsize=64)
        self._position = 0

    def send(self, sound: Sound) -> bool:
        heard = HeardSound(self._position, sound, not sound.samples.any())
        self._position += len(sound.samples)
        if self._waiting.full():
            return False
        self._waiting.put_nowait(heard)
        return True

    async def next(self) -> HeardSound | None:
        return await self._waiting.get()

    def stop(self) -> None:
        """Nothing is held."""
