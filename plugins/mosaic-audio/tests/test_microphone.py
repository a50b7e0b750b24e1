from __future__ import annotations

import sys
import time
import wave
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from mosaic_audio.file_source import NoSoundFile
from mosaic_audio.microphone import MicrophoneConfigurer, is_file
from mosaic_core import DeviceGone
from mosaic_core.testing import build, fake_host, take_sounds


def clip_of(path: Path, seconds: float, rate_hz: int = 16_000, channels: int = 1, hz: float = 440) -> Path:
    count = round(seconds * rate_hz)
    samples = (np.sin(np.arange(count) * 2 * np.pi * hz / rate_hz) * 10_000).astype("<i2")
    with wave.open(str(path), "wb") as file:
        file.setnchannels(channels)
        file.setsampwidth(2)
        file.setframerate(rate_hz)
        file.writeframes(np.repeat(samples, channels).tobytes())
    return path


def peak_hz(samples: Any, rate_hz: int) -> float:
    spectrum = np.abs(np.fft.rfft(samples[:, 0]))
    return float(np.fft.rfftfreq(len(samples), 1 / rate_hz)[spectrum.argmax()])


def joined(sounds: list[Any]) -> Any:
    return np.concatenate([sound.samples for sound in sounds])


def test_a_tone_has_its_pitch_and_no_clicks_between_its_pieces() -> None:
    sounds = take_sounds(build(MicrophoneConfigurer, params={"source": "tone:1000"}), 60)
    samples = joined(sounds)
    assert peak_hz(samples, sounds[0].rate_hz) == pytest.approx(1000, abs=2)
    steps = np.abs(np.diff(samples[:, 0].astype(int)))
    assert steps.max() < 8191 * 2 * np.pi * 1000 / 48_000 * 1.05


def test_pieces_follow_each_other_without_gaps_in_time() -> None:
    sounds = take_sounds(build(MicrophoneConfigurer, params={"source": "tone"}), 20)
    times = [sound.captured_at_s for sound in sounds]
    assert np.diff(times) == pytest.approx(0.02)
    assert {sound.samples.shape for sound in sounds} == {(960, 1)}


def test_a_file_is_heard_at_its_pace_and_pitch(tmp_path: Path) -> None:
    path = clip_of(tmp_path / "clip.wav", 0.5)
    microphone = build(MicrophoneConfigurer, params={"source": str(path), "loop": False})
    began_s = fake_host(microphone).clock.now_s
    sounds = take_sounds(microphone)
    assert sum(sound.duration_s for sound in sounds) == pytest.approx(0.5, abs=0.03)
    assert fake_host(microphone).clock.now_s - began_s == pytest.approx(0.5, abs=0.05)
    assert peak_hz(joined(sounds), 48_000) == pytest.approx(440, abs=4)


def test_a_file_in_stereo_stays_so_unless_one_channel_is_asked_for(tmp_path: Path) -> None:
    source = str(clip_of(tmp_path / "clip.wav", 0.2, channels=2))
    assert take_sounds(build(MicrophoneConfigurer, params={"source": source}), 1)[0].samples.shape[1] == 2
    assert (
        take_sounds(build(MicrophoneConfigurer, params={"source": source, "channels": 1}), 1)[0].samples.shape[1] == 1
    )


def test_a_file_begins_anew_when_it_ends(tmp_path: Path) -> None:
    source = str(clip_of(tmp_path / "clip.wav", 0.1))
    assert len(take_sounds(build(MicrophoneConfigurer, params={"source": source}), 40)) == 40


@pytest.mark.parametrize(("name", "why"), [("absent.wav", "no such file"), ("text.wav", "Invalid data")])
def test_a_file_that_is_no_sound_is_an_error_that_names_it(tmp_path: Path, name: str, why: str) -> None:
    (tmp_path / "text.wav").write_text("no sound")
    microphone = build(MicrophoneConfigurer, params={"source": str(tmp_path / name)})
    with pytest.raises(NoSoundFile, match=f"{name} can't be played: .*{why}"):
        take_sounds(microphone, 1)


def test_gain_makes_louder_and_clips_what_is_too_loud() -> None:
    quiet = joined(take_sounds(build(MicrophoneConfigurer, params={"source": "tone"}), 5))
    louder = joined(take_sounds(build(MicrophoneConfigurer, params={"source": "tone", "gain_db": 6.0206}), 5))
    clipped = joined(take_sounds(build(MicrophoneConfigurer, params={"source": "tone", "gain_db": 40}), 5))
    assert np.abs(louder - 2 * quiet.astype(int)).max() <= 2
    assert clipped.max() == 32_767
    assert clipped.min() == -32_768


@pytest.mark.parametrize("source", ["tone:5", "tone:high", "tone:"])
def test_a_tone_that_nobody_hears_is_refused(source: str) -> None:
    with pytest.raises(Exception, match="tone:440") as caught:
        build(MicrophoneConfigurer, params={"source": source})
    assert not isinstance(caught.value, ValidationError) or "source" in str(caught.value)


@pytest.mark.parametrize(
    ("source", "expected"),
    [("siren.WAV", True), ("./siren", True), ("HDA Intel PCH: ALC257 (hw:0,0)", False), ("USB 2.0: Audio", False)],
)
def test_names_of_devices_are_told_from_files(source: str, expected: bool) -> None:
    assert is_file(source) is expected


def test_a_device_is_heard_with_the_time_when_it_heard(portaudio: Any) -> None:
    began_s = time.monotonic()
    sounds = take_sounds(build(MicrophoneConfigurer, params={"rate_hz": 16_000}), 3)
    stream = portaudio.streams[0]
    assert {sound.samples.shape for sound in sounds} == {(320, 1)}
    assert -0.05 < sounds[0].captured_at_s - began_s < 0.0 + (time.monotonic() - began_s)
    assert stream.options["samplerate"] == 16_000
    assert stream.is_closed


def test_a_device_is_found_by_its_number(portaudio: Any) -> None:
    take_sounds(build(MicrophoneConfigurer, params={"source": "0"}), 1)
    assert portaudio.streams[0].options["device"] == 0


def test_an_unknown_device_is_an_error_that_names_those_there_are(portaudio: Any) -> None:
    with pytest.raises(DeviceGone, match="no input device 'webcam'; choose one of: headset") as caught:
        take_sounds(build(MicrophoneConfigurer, params={"source": "webcam"}), 1)
    assert caught.value.code == "plugin.no_device"


def test_a_device_without_an_input_is_an_error(portaudio: Any) -> None:
    with pytest.raises(DeviceGone, match="has no input; choose one of: headset"):
        take_sounds(build(MicrophoneConfigurer, params={"source": "monitor"}), 1)


def test_a_device_that_another_program_holds_is_an_error(portaudio: Any) -> None:
    portaudio.is_busy = True
    with pytest.raises(DeviceGone, match="can't be opened: Device unavailable"):
        take_sounds(build(MicrophoneConfigurer), 1)


def test_without_portaudio_the_error_says_what_to_install(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "sounddevice.py").write_text("raise OSError('PortAudio library not found')")
    monkeypatch.delitem(sys.modules, "sounddevice", raising=False)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(DeviceGone, match=r"PortAudio library is not installed; .*libportaudio2"):
        take_sounds(build(MicrophoneConfigurer), 1)


def test_the_plugin_is_imported_without_portaudio() -> None:
    import subprocess

    code = "import sys, mosaic_audio.microphone, mosaic_audio.speaker; sys.exit('sounddevice' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
