"""`speaker`: what an operator says, out of a sound device of the robot."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import numpy as np
from pydantic import Field

from mosaic_audio.devices import DEFAULT, OpenStream, chosen_device, portaudio
from mosaic_audio.microphone import clipped
from mosaic_audio.wav_sink import WavSink
from mosaic_core import AudioReceivable, MediaTrackConfigurer, Params, Sender, Sound, unit


class Sink(Protocol):
    """Plays or writes sound. Used on the speaker's thread."""

    def play(self, sound: Sound) -> None: ...
    def rest(self) -> None:
        """Nobody talks any more."""
        ...


class SpeakerParams(Params):
    """Params of a loudspeaker."""

    output: int | str = Field(
        default=DEFAULT,
        description="Name or number of a sound device (`python -m sounddevice` lists them), or a `.wav` file to write.",
    )
    gain_db: float = Field(
        default=0.0, ge=-60, le=40, description="Louder or quieter; what is too loud is clipped.",
        json_schema_extra=unit("dB"),
    )  # fmt: skip


class Speaker(AudioReceivable):
    """Plays an operator's voice on a sound device or into a file."""

    widget = "push-to-talk"

    def __init__(self, label: str, params: SpeakerParams) -> None:
        super().__init__(label)
        self._gain = 10 ** (params.gain_db / 20)
        self._sink: Sink = _sink_of(params.output)

    def handle_sound(self, sound: Sound, sender: Sender) -> None:
        samples = sound.samples
        if self._gain != 1.0:
            samples = clipped(samples * self._gain)
        self._sink.play(Sound(samples, sound.rate_hz, sound.captured_at_s))

    def talk_ended(self) -> None:
        self._sink.rest()


class DeviceSink:
    """A sound device, open only while somebody talks, so that other programs may have it."""

    def __init__(self, device: int | str) -> None:
        self._device = device
        self._stream: OpenStream | None = None
        self._channels = 0

    def play(self, sound: Sound) -> None:
        if self._stream is None:
            sounds = portaudio()
            wanted, self._channels = chosen_device(sounds, self._device, "output")
            self._stream = OpenStream(
                sounds, "output", device=wanted, samplerate=sound.rate_hz, channels=self._channels
            )
        samples = sound.samples
        if self._channels == 1 and samples.shape[1] == 2:
            samples = samples.mean(axis=1, keepdims=True).astype(np.int16)
        self._stream.write(np.ascontiguousarray(samples))

    def rest(self) -> None:
        stream, self._stream = self._stream, None
        if stream is not None:
            stream.close()


def _sink_of(output: int | str) -> Sink:
    if isinstance(output, str) and output.lower().endswith(".wav"):
        return WavSink(Path(output))
    return DeviceSink(int(output) if isinstance(output, str) and output.isdecimal() else output)


class SpeakerConfigurer(MediaTrackConfigurer[SpeakerParams]):
    """Plays what an operator says on a sound device."""

    connector_type = "speaker"

    def configure(self) -> Speaker:
        return Speaker(self.label, self.params)
