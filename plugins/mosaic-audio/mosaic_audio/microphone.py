"""`microphone`: what a sound device hears, or a sound file, or a tone to test with."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator

from mosaic_audio.device_source import device_sounds
from mosaic_audio.devices import DEFAULT, portaudio
from mosaic_core import AudioTrackHandler, MediaTrackConfigurer, Sound, SoundEncoding, unit
from mosaic_core.contract.sound import Samples

TONE = "tone"
PIECE_S = 0.02
LATE_S = 0.2
"""A file that is further behind than this goes on from here instead of catching up."""
SUFFIXES = {".aac", ".flac", ".m4a", ".mka", ".mkv", ".mp3", ".mp4", ".oga", ".ogg", ".opus", ".wav", ".webm"}


class MicrophoneParams(SoundEncoding):
    """Params of a microphone."""

    source: int | str = Field(
        default=DEFAULT,
        description="Name or number of a sound device (`python -m sounddevice` lists them), a sound file, or "
        "`tone:440` for a tone of so many hertz.",
    )
    rate_hz: int = Field(
        default=48_000,
        ge=8_000,
        le=192_000,
        description="Samples per second that the device is asked for.",
        json_schema_extra=unit("Hz"),
    )
    channels: Literal[1, 2] | None = Field(default=None, description="Default: a device gives 1, a file what it has.")
    gain_db: float = Field(
        default=0.0, ge=-60, le=40, description="Louder or quieter; what is too loud is clipped.",
        json_schema_extra=unit("dB"),
    )  # fmt: skip
    loop: bool = Field(default=True, description="Play a sound file again when it ends.")

    @field_validator("source")
    @classmethod
    def _known(cls, source: int | str) -> int | str:
        if isinstance(source, str) and source.partition(":")[0] == TONE and not 20 <= tone_hz(source) <= 20_000:
            raise ValueError("a tone is written `tone:440`, between 20 and 20000 hertz")
        return int(source) if isinstance(source, str) and source.isdecimal() else source


class Microphone(AudioTrackHandler):
    """Hears a sound device, a sound file or a tone, and sends it to operators."""

    widget = "audio"

    def __init__(self, label: str, params: MicrophoneParams) -> None:
        super().__init__(label)
        self._params = params
        self._gain = 10 ** (params.gain_db / 20)
        self.encoding = params

    def sounds(self) -> Iterator[Sound]:
        for sound in self._heard():
            yield sound if self._gain == 1.0 else Sound(self._louder(sound.samples), sound.rate_hz, sound.captured_at_s)

    def _heard(self) -> Iterator[Sound]:
        params, source = self._params, self._params.source
        if isinstance(source, str) and source.partition(":")[0] == TONE:
            return self._paced(tone(tone_hz(source)), 48_000)
        if isinstance(source, str) and is_file(source):
            return self._paced(self._file(Path(source)), 48_000)
        return device_sounds(portaudio(), source, params.rate_hz, params.channels, lambda: self.is_stopping)

    def _file(self, path: Path) -> Iterator[Samples]:
        from mosaic_audio.file_source import file_sounds

        is_empty = False
        while not is_empty:
            is_empty = True
            for samples in file_sounds(path, self._params.channels):
                is_empty = False
                yield samples
            if not self._params.loop:
                return

    def _paced(self, pieces: Iterator[Samples], rate_hz: int) -> Iterator[Sound]:
        """Each piece at its time, as a device would have heard it."""
        due_s = self.monotonic_s()
        for samples in pieces:
            now_s = self.monotonic_s()
            due_s = now_s if now_s - due_s > LATE_S else due_s
            if self.pause(max(0.0, due_s - now_s)):
                return
            yield Sound(samples, rate_hz, due_s)
            due_s += len(samples) / rate_hz

    def _louder(self, samples: Samples) -> Samples:
        return clipped(samples * self._gain)


def clipped(samples: NDArray[np.floating[Any]]) -> Samples:
    """What is too loud for 16 bits, as loud as they go."""
    limited: Samples = np.clip(samples, -32768, 32767).astype(np.int16)
    return limited


def is_file(source: str) -> bool:
    """Whether a source is a path; names of devices have dots and spaces too."""
    return "/" in source or Path(source).suffix.lower() in SUFFIXES


def tone_hz(source: str) -> float:
    """The frequency in ``tone:440``; 0 for what is no number."""
    _, colon, text = source.partition(":")
    try:
        return float(text) if colon else 440.0
    except ValueError:
        return 0.0


def tone(frequency_hz: float, rate_hz: int = 48_000, level: float = 0.25) -> Iterator[Samples]:
    """A sine without end in pieces of 20 ms; ``level`` 1 is full scale."""
    count, first = round(rate_hz * PIECE_S), 0
    while True:
        phase = (np.arange(first, first + count) * frequency_hz / rate_hz) % 1.0 * 2 * math.pi
        yield (np.sin(phase) * level * 32767).astype(np.int16).reshape(-1, 1)
        first = (first + count) % rate_hz if frequency_hz == int(frequency_hz) else first + count


class MicrophoneConfigurer(MediaTrackConfigurer[MicrophoneParams]):
    """Sends what a sound device hears, a sound file or a tone."""

    connector_type = "microphone"
    trial: ClassVar[dict[str, Any] | None] = {"source": "tone:440"}

    def configure(self) -> Microphone:
        return Microphone(self.label, self.params)
