"""Sound devices that are pulled out and plugged in again, that say more than anybody hears, or nonsense."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest

from mosaic_audio.devices import DeviceList
from mosaic_audio.microphone import MicrophoneConfigurer
from mosaic_audio.speaker import SpeakerConfigurer
from mosaic_core import DeviceGone, Sender, Sound
from mosaic_core.testing import build, fake_host, take_sounds

ANN = Sender("peer", "session", name="Ann")
HEADSET = {"name": "headset", "max_input_channels": 1, "max_output_channels": 1}


def voice() -> Sound:
    return Sound(np.full((960, 2), 1000, np.int16), 48_000, 1.0)


def test_a_microphone_that_is_unplugged_for_thirty_seconds_is_gone_and_then_heard_again(portaudio: Any) -> None:
    microphone = build(MicrophoneConfigurer, params={"source": "headset"})
    with pytest.raises(DeviceGone, match="gives no sound any more"):
        take_sounds(microphone, 4)  # it hears three pieces and no more
    portaudio.plugged_in = []
    for _ in range(6):  # as the robot tries again
        fake_host(microphone).clock.advance(5.0)
        with pytest.raises(DeviceGone, match="no input device 'headset'"):
            take_sounds(microphone, 1)
    portaudio.plugged_in = [HEADSET]
    assert len(take_sounds(microphone, 3)) == 3
    assert all(stream.is_closed for stream in portaudio.streams)


def test_a_loudspeaker_that_is_unplugged_for_thirty_seconds_while_somebody_talks_is_gone_and_then_plays_again(
    portaudio: Any,
) -> None:
    speaker = build(SpeakerConfigurer, params={"output": "headset"})
    speaker.handle_sound(voice(), ANN)
    portaudio.streams[0].is_unplugged = True
    portaudio.plugged_in = []
    with pytest.raises(DeviceGone, match="the output device is gone: Unanticipated host error"):
        speaker.handle_sound(voice(), ANN)
    speaker.talk_ended()
    for _ in range(6):  # as the robot tries again
        fake_host(speaker).clock.advance(5.0)
        with pytest.raises(DeviceGone, match="no output device 'headset'"):
            speaker.handle_sound(voice(), ANN)
        speaker.talk_ended()
    portaudio.plugged_in = [HEADSET]
    speaker.handle_sound(voice(), ANN)
    assert len(portaudio.streams[-1].written) == 1


def test_portaudio_looks_anew_only_after_a_loss_and_while_nobody_plays(portaudio: Any) -> None:
    devices = DeviceList()
    devices.query(portaudio, None, "input")
    devices.stream_began()
    devices.lost()
    devices.query(portaudio, None, "input")
    assert portaudio.begins == 1
    devices.stream_ended()
    for _ in range(2):
        devices.query(portaudio, None, "input")
    assert portaudio.begins == 2


def test_of_a_flood_the_newest_is_heard(portaudio: Any) -> None:
    portaudio.stream_facts = {"pieces": 1000}
    sounds = take_sounds(build(MicrophoneConfigurer, params={"source": "headset"}), 10)
    assert [int(sound.samples[0, 0]) for sound in sounds] == list(range(1990, 2000))


@pytest.mark.parametrize("heard_at_s", [-1e9, 4.0, 5.1, 1e9, float("nan")])
def test_a_driver_whose_clock_is_nonsense_is_not_believed(portaudio: Any, heard_at_s: float) -> None:
    portaudio.stream_facts = {"heard_at_s": heard_at_s}
    before_s = time.monotonic()
    (sound,) = take_sounds(build(MicrophoneConfigurer, params={"source": "headset"}), 1)
    assert before_s - 0.5 <= sound.captured_at_s <= time.monotonic()
