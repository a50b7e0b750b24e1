from __future__ import annotations

from typing import Any

import av
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mosaic_core import Sound
from mosaic_core.adapters.sound.sound_encoder import PACKET_SAMPLES, RATE_HZ, SoundEncoder


def piece(count: int, captured_at_s: float, rate_hz: int = RATE_HZ, channels: int = 1, hz: float = 440) -> Sound:
    time_s = captured_at_s + np.arange(count) / rate_hz
    samples = (np.sin(2 * np.pi * hz * time_s) * 9000).astype(np.int16).reshape(-1, 1)
    return Sound(np.repeat(samples, channels, axis=1), rate_hz, captured_at_s)


def decoded(packets: list[Any]) -> Any:
    decoder = av.CodecContext.create("libopus", "r")
    frames = [frame for packet in packets for frame in decoder.decode(av.Packet(bytes(packet)))]
    return np.concatenate([frame.to_ndarray().reshape(-1, frame.layout.nb_channels) for frame in frames])


@pytest.mark.parametrize(("rate_hz", "channels"), [(48_000, 1), (48_000, 2), (44_100, 2), (16_000, 1), (8_000, 1)])
def test_sound_of_any_rate_keeps_its_pitch(rate_hz: int, channels: int) -> None:
    encoder, packets = SoundEncoder(64_000), []
    for number in range(50):
        count = rate_hz // 50
        packets += list(encoder.encode(piece(count, 5 + number * 0.02, rate_hz, channels)))
    samples = decoded(packets)[-RATE_HZ // 2 :, 0].astype(float)
    pitch = np.fft.rfftfreq(len(samples), 1 / RATE_HZ)[np.abs(np.fft.rfft(samples)).argmax()]
    assert pitch == pytest.approx(440, abs=3)


def test_time_stamps_are_the_capture_time_at_48_khz_without_gaps() -> None:
    encoder, packets = SoundEncoder(40_000), []
    for number in range(20):
        packets += list(encoder.encode(piece(960, 100.0 + number * 0.02)))
    stamps = [packet.pts for packet in packets]
    assert stamps[0] == 100 * RATE_HZ
    assert set(np.diff(stamps)) == {PACKET_SAMPLES}
    assert {packet.time_base.denominator for packet in packets} == {RATE_HZ}


def test_after_a_pause_of_the_source_the_time_stamps_follow_the_clock() -> None:
    encoder = SoundEncoder(40_000)
    list(encoder.encode(piece(4800, 1.0)))
    after = list(encoder.encode(piece(4800, 9.0)))
    assert after[0].pts == 9 * RATE_HZ


def test_a_clock_that_jitters_a_little_moves_nothing() -> None:
    encoder = SoundEncoder(40_000)
    stamps = []
    for number in range(50):
        late_s = 0.03 * (number % 3)
        stamps += [packet.pts for packet in encoder.encode(piece(960, 1.0 + number * 0.02 + late_s))]
    assert set(np.diff(stamps)) == {PACKET_SAMPLES}


@settings(max_examples=30, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 5000), st.floats(0, 30)), max_size=12))
def test_time_stamps_never_go_back_whatever_the_source_says(pieces: list[tuple[int, float]]) -> None:
    encoder, stamps = SoundEncoder(40_000), []
    for count, captured_at_s in pieces:
        stamps += [packet.pts for packet in encoder.encode(piece(count, captured_at_s))]
    assert all(step >= PACKET_SAMPLES for step in np.diff(stamps))


def test_rested_it_begins_anew_with_nothing_old() -> None:
    encoder = SoundEncoder(40_000)
    list(encoder.encode(piece(700, 1.0)))
    encoder.rest()
    packets = list(encoder.encode(piece(2 * 960, 1.02)))
    assert packets[0].pts == round(1.02 * RATE_HZ)


def test_more_than_two_channels_give_the_first_two() -> None:
    assert list(SoundEncoder(64_000).encode(piece(9600, 1.0, channels=6)))


@pytest.mark.parametrize(
    "samples", [np.zeros(960, np.int16), np.zeros((960, 1), np.float32), np.zeros((960, 0), np.int16), [1, 2, 3]]
)
def test_what_is_no_sound_is_refused(samples: Any) -> None:
    with pytest.raises(TypeError, match=r"int16 samples of shape \(n, channels\)"):
        list(SoundEncoder(40_000).encode(Sound(samples, RATE_HZ, 1.0)))


@pytest.mark.parametrize("rate_hz", [0, -1, 10**7])
def test_an_impossible_rate_is_refused(rate_hz: int) -> None:
    with pytest.raises(TypeError, match="out of range"):
        list(SoundEncoder(40_000).encode(Sound(np.zeros((10, 1), np.int16), rate_hz, 1.0)))
