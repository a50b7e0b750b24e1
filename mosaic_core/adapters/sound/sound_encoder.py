"""Sound of any rate and shape as Opus packets of 20 ms at 48 kHz, on the robot's capture clock."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import Any

import av
import numpy as np
from av.audio.codeccontext import AudioCodecContext

from mosaic_core.contract.declared.sent_sound import sound_mistake
from mosaic_core.contract.sound import Samples, Sound

RATE_HZ = 48_000
PACKET_SAMPLES = 960
SOUND_TIME_BASE = Fraction(1, RATE_HZ)
MAX_DRIFT_S = 0.1
"""A capture clock further away than this from the samples that were counted: the source paused, start anew."""
_OPTIONS = {
    "application": "voip",  # speech codec at low rates: the only one that can repair losses
    "fec": "1",
    "packet_loss": "5",
    "frame_duration": "20",
}


class SoundEncoder:
    """Encodes the sound of one microphone. ``encode`` on one thread at a time; the state is made when sound of a new
    shape comes.
    """

    def __init__(self, bitrate_bps: int) -> None:
        self._bitrate_bps = bitrate_bps
        self._shape = (0, 0)
        self._resampler: av.AudioResampler | None = None
        self._codec: AudioCodecContext | None = None
        self._pts = 0
        self._taken = 0
        self._start = 0

    def encode(self, sound: Sound) -> Iterator[av.Packet[Any]]:
        """Packets with pts = capture time x 48 kHz. Raises :class:`TypeError` for what is no sound."""
        samples = checked_samples(sound)
        if len(samples) == 0:
            return
        self._follow(samples.shape[1], sound)
        assert self._resampler is not None
        assert self._codec is not None
        frame = av.AudioFrame.from_ndarray(samples.reshape(1, -1), "s16", _layout(samples.shape[1]))
        frame.sample_rate = sound.rate_hz
        frame.pts, frame.time_base = self._taken, Fraction(1, sound.rate_hz)
        self._taken += len(samples)
        for piece in self._resampler.resample(frame):
            piece.pts = None
            for packet in self._codec.encode(piece):
                packet.pts = packet.dts = self._pts
                packet.time_base = SOUND_TIME_BASE
                self._pts += PACKET_SAMPLES
                yield packet

    def rest(self) -> None:
        """Nobody listens: what is half encoded is old by the time that somebody does."""
        self._shape = (0, 0)

    def _follow(self, channels: int, sound: Sound) -> None:
        """Begin anew where the source changed or paused; time stamps never go back."""
        captured = round(sound.captured_at_s * RATE_HZ)
        expected = self._pts + round(self._waiting_s(sound) * RATE_HZ)
        if self._shape == (channels, sound.rate_hz) and abs(captured - expected) <= MAX_DRIFT_S * RATE_HZ:
            return
        self._shape, self._taken, self._start = (channels, sound.rate_hz), 0, max(captured, self._pts)
        self._pts = self._start
        self._resampler = av.AudioResampler(
            format="s16", layout=_layout(channels), rate=RATE_HZ, frame_size=PACKET_SAMPLES
        )
        self._codec = _opened(channels, self._bitrate_bps)

    def _waiting_s(self, sound: Sound) -> float:
        """What was taken but is in no packet yet."""
        if not self._taken:
            return 0.0
        return self._taken / sound.rate_hz - (self._pts - self._start) / RATE_HZ


def checked_samples(sound: Sound) -> Samples:
    """The samples, of at most two channels. Raises :class:`TypeError` for what is no sound."""
    if mistake := sound_mistake(sound):
        raise TypeError(mistake)
    return np.ascontiguousarray(sound.samples[:, :2])


def _layout(channels: int) -> str:
    return "mono" if channels == 1 else "stereo"


def _opened(channels: int, bitrate_bps: int) -> AudioCodecContext:
    codec = av.CodecContext.create("libopus", "w")
    assert isinstance(codec, AudioCodecContext)
    codec.bit_rate = bitrate_bps
    codec.format = "s16"
    codec.layout = _layout(channels)
    codec.sample_rate = RATE_HZ
    codec.time_base = SOUND_TIME_BASE
    codec.options = dict(_OPTIONS)
    return codec
