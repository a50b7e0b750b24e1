"""Sound over WebRTC: a track that sends encoded packets, and what arrives on one."""

from __future__ import annotations

import time
from typing import Any

import av
import numpy as np
from aiortc import RTCRtpSender
from aiortc.mediastreams import MediaStreamError, MediaStreamTrack

from mosaic_core.adapters.aiortc_private.rtp.paced_transport import WatchedTransport
from mosaic_core.adapters.aiortc_private.rtp.packet_arrivals import PacketNumbers, never_repeat
from mosaic_core.adapters.sound.shared_sound import SoundFeed
from mosaic_core.adapters.sound.sound_encoder import RATE_HZ, SoundEncoder
from mosaic_core.adapters.video.video_track import FeedTrack
from mosaic_core.contract.sound import Sound
from mosaic_core.machines.congestion.budget_allocator import DRIVES, Demand
from mosaic_core.runtime.timing.deadline_timer import DeadlineTimer
from mosaic_core.runtime.transport.media_transport import HeardSound
from mosaic_core.runtime.transport.peer_congestion import PeerCongestion

MEASURED_S, SILENT_S = 1.0, 3.0
ASSUMED_BPS = 48_000
"""Of the first second: Opus at its usual rate, with headers."""
SILENT_PEAK = 33
"""Of 32 767: quieter than -60 dB is nobody's voice."""


class SoundTrack(FeedTrack):
    """Sends the sound of one microphone to one operator, or an operator's voice to the robot."""

    kind = "audio"
    _share: SoundShare | None = None

    def count_in(self, connection: PeerCongestion, sender: RTCRtpSender) -> None:
        """It shares the operator's budget: the other side reports when each of its packets arrived."""
        self._share = SoundShare(connection, sender)

    def stop(self) -> None:
        super().stop()
        if self._share is not None:
            self._share.end()


class SoundShare:
    """Takes what sound needs out of the budget of one operator, before all pictures, while it is sent."""

    def __init__(self, connection: PeerCongestion, sender: RTCRtpSender) -> None:
        self._connection = connection
        self._numbers = PacketNumbers(sender, connection.reported)
        self._transport = WatchedTransport(sender, self._left)
        self._silence = DeadlineTimer(self.end)
        self._began_s = self._bytes = 0.0
        never_repeat(sender)

    def _left(self, data: bytes) -> None:
        number = self._numbers.take()
        if number is None:
            return
        self._connection.packet_left(number, len(data))
        self._connection.sent(len(data))
        self._note(len(data), time.monotonic())

    def _note(self, size_bytes: int, now_s: float) -> None:
        """Once per second, what it takes is what it took."""
        self._bytes += size_bytes
        if now_s - self._began_s < MEASURED_S:
            return
        is_known = now_s - self._began_s < SILENT_S
        bps = round(self._bytes * 8 / (now_s - self._began_s)) if is_known else ASSUMED_BPS
        self._connection.want(self, Demand(bps, bps, DRIVES), lambda: None)
        self._silence.set(now_s + SILENT_S)
        self._began_s, self._bytes = now_s, 0.0

    def end(self) -> None:
        self._silence.cancel()
        self._connection.want_nothing(self)


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
