from __future__ import annotations

import wave
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mosaic_audio.speaker import SpeakerConfigurer
from mosaic_core import DeviceGone, Sender, Sound
from mosaic_core.testing import build

ANN = Sender("peer", "session", name="Ann")


def voice(level: int = 1000) -> Sound:
    return Sound(np.full((960, 2), level, np.int16), 48_000, 1.0)


def test_the_device_is_open_only_while_somebody_talks(portaudio: Any) -> None:
    speaker = build(SpeakerConfigurer, params={"output": "monitor"})
    assert portaudio.streams == []
    speaker.handle_sound(voice(), ANN)
    speaker.handle_sound(voice(), ANN)
    (stream,) = portaudio.streams
    assert stream.is_running
    assert [samples.shape for samples in stream.written] == [(960, 2), (960, 2)]
    speaker.talk_ended()
    assert stream.is_closed
    speaker.handle_sound(voice(), ANN)
    assert len(portaudio.streams) == 2


def test_a_device_of_one_channel_gets_both_mixed(portaudio: Any) -> None:
    speaker = build(SpeakerConfigurer, params={"output": "headset"})
    speaker.handle_sound(Sound(np.tile(np.array([[1000, 3000]], np.int16), (960, 1)), 48_000, 1.0), ANN)
    (samples,) = portaudio.streams[0].written
    assert samples.shape == (960, 1)
    assert set(samples.ravel()) == {2000}


def test_gain_clips_what_is_too_loud(portaudio: Any) -> None:
    speaker = build(SpeakerConfigurer, params={"output": "monitor", "gain_db": 20})
    speaker.handle_sound(voice(30_000), ANN)
    speaker.handle_sound(voice(100), ANN)
    loud, soft = portaudio.streams[0].written
    assert set(loud.ravel()) == {32_767}
    assert set(soft.ravel()) == {1000}


def test_an_unknown_device_is_an_error_that_names_those_there_are(portaudio: Any) -> None:
    speaker = build(SpeakerConfigurer, params={"output": "horn"})
    with pytest.raises(DeviceGone, match="no output device 'horn'; choose one of: headset, monitor"):
        speaker.handle_sound(voice(), ANN)


def test_a_wav_file_is_valid_at_every_moment_and_holds_all_talks(tmp_path: Path) -> None:
    path = tmp_path / "said.wav"
    speaker = build(SpeakerConfigurer, params={"output": str(path)})
    for talks in (1, 2):
        speaker.handle_sound(voice(), ANN)
        speaker.talk_ended()
        with wave.open(str(path), "rb") as file:
            assert (file.getnchannels(), file.getframerate()) == (2, 48_000)
            assert file.getnframes() == 960 * talks
            assert np.frombuffer(file.readframes(960), np.int16)[0] == 1000


def test_nobody_having_talked_there_is_nothing_to_end(portaudio: Any) -> None:
    build(SpeakerConfigurer).talk_ended()
    assert portaudio.streams == []
