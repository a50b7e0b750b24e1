"""The stores of pictures and sound: a camera's frames, a microphone's pieces, and one's own voice for a loudspeaker."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from mosaic_core.operator.delivery.listeners import Listeners, all_heard
from mosaic_core.operator.stores.mosaic_store import MosaicStore
from mosaic_core.operator.stores.robot_connector import RobotConnector
from mosaic_core.words.control import MOST_SHOWN_PX
from mosaic_core.words.errors import MosaicError

if TYPE_CHECKING:
    import av

    from mosaic_core.contract.media import Image
    from mosaic_core.contract.sound import Sound
    from mosaic_core.runtime.transport.operator_transport import OutgoingSound


@dataclass(frozen=True, slots=True)
class Shown:
    """The size and purpose with which a picture is shown: width x height in pixels, and whether somebody, or a program,
    drives by it."""

    size_px: int
    leads: bool = False

    def __post_init__(self) -> None:
        if isinstance(self.size_px, bool) or not isinstance(self.size_px, int):
            raise TypeError(f"size_px is a whole number, width x height, not {self.size_px!r}")
        if not 0 <= self.size_px <= MOST_SHOWN_PX:
            raise ValueError(f"size_px is width x height, 0 to {MOST_SHOWN_PX}, not {self.size_px}")


class MediaStreamStore(MosaicStore):
    """Receives one camera's pictures. While this store exists the robot sends them; without any it captures nothing."""

    def __init__(self, robot_connector: RobotConnector) -> None:
        super().__init__(robot_connector)
        self.latest_frame: av.VideoFrame | None = None
        self.received_frames = 0
        self.shown: Shown | None = None
        """What :meth:`set_shown` was told."""
        self._tell_shown: Callable[[], None] | None = None
        self._arrived = asyncio.Event()

    def set_shown(self, shown: Shown) -> None:
        """Tell the robot how the picture is shown: a narrow link serves the picture that leads first, and the others by
        their size. What is not told counts as a picture of 640 x 360. Event loop only. Raises :class:`TypeError`."""
        if not isinstance(shown, Shown):
            raise TypeError(f"set_shown takes a Shown, such as Shown(640 * 480), not {shown!r}")
        if shown == self.shown:
            return
        self.shown = shown
        if self._tell_shown is not None:
            self._tell_shown()

    def connect_shown(self, tell: Callable[[], None] | None) -> None:
        """What to call when that changes; the connection sets it while the robot sends this picture."""
        self._tell_shown = tell

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


QUEUED_SOUNDS = 50
"""One second of 20 ms pieces: an iteration that falls further behind loses the oldest."""


class SoundStore(MosaicStore):
    """Receives a microphone's sound. While this store exists the robot sends it; without any it captures nothing."""

    def __init__(self, robot_connector: RobotConnector) -> None:
        super().__init__(robot_connector)
        self.latest_sound: Sound | None = None
        self.received_sounds = 0
        self._hearers: Listeners[[Sound]] = Listeners()

    def sounds(self) -> AsyncIterator[Sound]:
        """Every piece that arrives from now on: 48 kHz, ``int16`` (960, 2), ``captured_at_s`` = its arrival here by
        ``time.monotonic()``."""
        return all_heard(self._hearers.add, QUEUED_SOUNDS)

    def sound_arrived(self, sound: Sound) -> None:
        """Called by the connection with every piece."""
        self.latest_sound = sound
        self.received_sounds += 1
        self._hearers.tell(sound)


class VoiceStore(MosaicStore):
    """Sends a voice to the robot: its loudspeaker says what is sent here, one operator at a time.

    Whom it refuses hears of it by :meth:`RobotConnection.on_refusal`: ``media.talk_busy`` while somebody else talks,
    ``lease.forbidden`` for observers.
    """

    def __init__(self, robot_connector: RobotConnector) -> None:
        super().__init__(robot_connector)
        self.talker: str | None = None
        """The name of who is heard now (oneself, too); ``None``: nobody."""
        self._line: OutgoingSound | None = None

    def connect_line(self, line: OutgoingSound | None) -> None:
        """Where to send to; the connection sets it."""
        self._line = line

    def send_sound(self, sound: Sound) -> bool:
        """Say this, of any rate and shape; send piece after piece at the pace of the sound. ``False`` if it was not
        accepted (not open, or the link does not take it). Raises :class:`TypeError` or :class:`ValueError` for what is
        no sound."""
        return self._line is not None and self._line.send(sound)

    def talking_changed(self, name: str | None) -> None:
        """Called by the connection."""
        self.talker = name

    def closed(self) -> None:
        self._line = self.talker = None
        super().closed()
