"""Sound over WebRTC: a track that sends encoded packets, and what arrives on one."""

from __future__ import annotations

import time
from typing import Any

import av
import numpy as np
from aiortc.mediastreams import MediaStreamError, MediaStreamTrack

from mosaic_core.adapters.sound.shared_sound import SoundFeed
from mosaic_core.adapters.sound.sound_encoder import RATE_HZ, SoundEncoder
from mosaic_core.adapters.video.video_track import FeedTrack
from mosaic_core.contract.sound import Sound
from mosaic_core.runtime.transport.media_transport import HeardSound

SILENT_PEAK = 33
"""Of 32 767: quieter than -60 dB is nobody's voice."""


class SoundTrack(FeedTrack):
    """One microphone for one operator, or an operator's voice."""

    kind = "audio"


class AiortcIncomingSound:
    """The sound that arrives on one track, for a loudspeaker; a ``runtime.transport.IncomingSound``."""

    def __init__(self, track: MediaStreamTrack) -> None:
        self._track = track

    async def next(self) -> HeardSound | None:
        try:
            frame = await self._track.recv()
        except MediaStreamError:
            return None
        samples = samples_of(frame)
        is_silent = not np.any((samples > SILENT_PEAK) | (samples < -SILENT_PEAK))
        return HeardSound(frame.pts or 0, Sound(samples, RATE_HZ, time.monotonic()), is_silent)

    def stop(self) -> None:
        self._track.stop()


class ReceivedSound:
    """The sound that an operator receives; a ``runtime.transport.IncomingVideo`` whose frames are :class:`Sound`."""

    def __init__(self, track: MediaStreamTrack) -> None:
        self._sound = AiortcIncomingSound(track)

    async def next(self) -> Sound | None:
        heard = await self._sound.next()
        return None if heard is None else heard.sound

    async def received(self) -> None:
        """Silence is nothing to complain of."""

    def rtp_timestamp(self, frame: Any) -> int | None:
        """Nobody judges how old sound is."""
        return None

    def stop(self) -> None:
        self._sound.stop()


class OutgoingVoice:
    """An operator's voice on its way to a loudspeaker; a ``runtime.transport.OutgoingSound``."""

    def __init__(self, bitrate_bps: int) -> None:
        self.feed = SoundFeed()
        self._encoder = SoundEncoder(bitrate_bps)

    def send(self, sound: Sound) -> bool:
        """``False`` where older sound had to go, because the link does not take it."""
        dropped = [self.feed.put(packet) for packet in self._encoder.encode(sound)]
        return not any(dropped)


def samples_of(frame: Any) -> Any:
    """``int16`` (n, 2) of a decoded frame."""
    assert isinstance(frame, av.AudioFrame)
    channels = frame.layout.nb_channels
    samples = frame.to_ndarray().reshape(-1, channels) if frame.format.is_packed else frame.to_ndarray().T
    return np.ascontiguousarray(samples if channels == 2 else np.repeat(samples[:, :1], 2, axis=1))
