"""Encoders: one picture in, one packet out at once, at the bit rate that is wanted, key frames only on request."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast
from weakref import WeakSet

import av
import numpy as np
import pytest
from av.codec.hwaccel import HWAccel

from mosaic_core.adapters.video import encoder_choice
from mosaic_core.adapters.video.encoder_choice import (
    KINDS,
    EncoderUnavailable,
    chosen_kind,
    measured_speed,
    presumed,
    probed,
)
from mosaic_core.adapters.video.picture import prepared_picture
from mosaic_core.adapters.video.video_encoder import EncoderKind, EncoderSettings, VideoEncoder

SOFTWARE = [kind for kind in KINDS if not kind.is_hardware]
DECODERS = {"VP8": "vp8", "H264": "h264"}
RNG = np.random.default_rng(1)
TEXTURE = np.kron(RNG.integers(40, 200, (30, 80), dtype=np.uint8), np.ones((8, 8), np.uint8))
NOISE = RNG.integers(0, 24, (7, 240, 320), dtype=np.uint8)


def moving(number: int, fps: float = 30.0) -> Any:
    """Blocks under a slow pan, with the noise of a sensor: never cheap, never a new scene."""
    shifted = np.roll(TEXTURE, 2 * number, axis=1)
    return prepared_picture(shifted[:240, :320] + NOISE[number % 7], 100 + number / fps)


def blocks(frame: Any) -> Any:
    """Means of 8 x 8 pixels: what is shown, without its noise."""
    return frame.to_ndarray(format="gray").reshape(30, 8, 40, 8).mean(axis=(1, 3))


def encoded(encoder: VideoEncoder, numbers: range, fps: float = 30.0) -> list[Any]:
    packets = []
    for number in numbers:
        picture = moving(number, fps)
        made = encoder.encode(picture, pts=picture.pts, as_key=False)
        assert len(made) == 1, "nothing is held back"
        assert made[0].pts == picture.pts
        packets += made
    return packets


def rate_bps(packets: list[Any], fps: float = 30.0) -> float:
    return sum(packet.size for packet in packets) * 8 * fps / len(packets)


@pytest.fixture(params=SOFTWARE, ids=lambda kind: kind.name)
def kind(request: pytest.FixtureRequest) -> EncoderKind:
    return cast(EncoderKind, request.param)


@pytest.mark.parametrize("preset", ["drive", "inspect"])
def test_pictures_come_out_at_once_and_only_the_first_is_a_key_frame(kind: EncoderKind, preset: Any) -> None:
    encoder = VideoEncoder(kind, EncoderSettings(320, 240, 30.0, 500_000, 500_000, preset))
    packets = encoded(encoder, range(40))
    assert [packet.is_keyframe for packet in packets] == [True] + [False] * 39
    decoder = cast(Any, av.CodecContext.create(DECODERS[kind.codec], "r"))
    shown = [frame for data in (*map(bytes, packets), None) for frame in decoder.decode(data and av.Packet(data))]
    assert len(shown) == 40
    assert np.abs(blocks(shown[-1]) - blocks(moving(39))).mean() < 6


def test_a_key_frame_on_request_can_be_shown_by_itself_and_is_no_burst(kind: EncoderKind) -> None:
    encoder = VideoEncoder(kind, EncoderSettings(320, 240, 30.0, 600_000, 600_000))
    ordinary = encoded(encoder, range(30))[1:]
    picture = moving(30)
    (key,) = encoder.encode(picture, pts=picture.pts, as_key=True)
    assert key.is_keyframe
    decoder = cast(Any, av.CodecContext.create(DECODERS[kind.codec], "r"))
    frames = [frame for data in (bytes(key), None) for frame in decoder.decode(data and av.Packet(data))]
    assert (frames[0].width, frames[0].height) == (320, 240)
    mean_bytes = sum(packet.size for packet in ordinary) / len(ordinary)
    assert key.size < 10 * mean_bytes


def test_the_bit_rate_is_followed_down_and_up(kind: EncoderKind) -> None:
    encoder = VideoEncoder(kind, EncoderSettings(320, 240, 30.0, 800_000, 800_000))
    at_first = rate_bps(encoded(encoder, range(90))[30:])
    encoder.follow(300_000, moving(90).pts)
    lower = encoded(encoder, range(90, 210))
    encoder.follow(800_000, moving(210).pts)
    higher = encoded(encoder, range(210, 330))
    assert 500_000 < at_first < 900_000
    assert rate_bps(lower[60:]) < 390_000
    assert rate_bps(higher[60:]) > 450_000
    assert not any(packet.is_keyframe for packet in lower + higher)


def test_a_small_change_of_rate_costs_no_key_frame(kind: EncoderKind) -> None:
    encoder = VideoEncoder(kind, EncoderSettings(320, 240, 30.0, 400_000, 800_000))
    encoded(encoder, range(10))
    for number in range(10, 100):
        encoder.follow(400_000 + 1_000 * number, moving(number).pts)
        assert not encoded(encoder, range(number, number + 1))[0].is_keyframe


def test_the_picture_after_a_pause_is_no_burst(kind: EncoderKind) -> None:
    encoder = VideoEncoder(kind, EncoderSettings(320, 240, 30.0, 400_000, 400_000))
    ordinary = encoded(encoder, range(60))[30:]
    picture = moving(60)
    (after,) = encoder.encode(picture, pts=picture.pts + 3 * 90_000, as_key=False)
    assert after.pts == picture.pts + 3 * 90_000
    assert after.size < 2.5 * max(packet.size for packet in ordinary)


def by_libvpx(follows: Any, bitrate_bps: int, ceiling_bps: int) -> VideoEncoder:
    """A kind that is driven in another way than it must be: no hardware is needed to see how that is."""
    settings = EncoderSettings(320, 240, 30.0, bitrate_bps, ceiling_bps)
    return VideoEncoder(replace(chosen_kind("VP8", "libvpx"), follows=follows), settings)


def keys_of(encoder: VideoEncoder, rates_bps: dict[int, int], pictures: int) -> list[int]:
    """Which pictures are key frames, if another bit rate is aimed at from some of them on."""
    keys, wanted_bps = [], 0
    for number in range(pictures):
        wanted_bps = rates_bps.get(number, wanted_bps)
        if wanted_bps:
            encoder.follow(wanted_bps, moving(number).pts)
        if encoded(encoder, range(number, number + 1))[0].is_keyframe:
            keys.append(number)
    return keys


def test_what_is_made_anew_for_another_rate_begins_with_a_key_frame_for_a_real_difference_alone() -> None:
    lower = keys_of(by_libvpx("anew", 400_000, 800_000), {10: 370_000, 20: 350_000}, 40)
    assert lower == [0, 20], "less at once, but a tenth"
    higher = keys_of(by_libvpx("anew", 400_000, 800_000), {10: 500_000, 20: 600_000}, 160)
    assert higher == [0, 130], "more than a third, four seconds after more was wanted"


def test_a_rate_far_from_the_first_is_out_of_a_clocks_reach() -> None:
    assert keys_of(by_libvpx("times", 100_000, 4_000_000), {10: 600_000}, 140) == [0]
    assert keys_of(by_libvpx("times", 100_000, 4_000_000), {10: 900_000}, 140) == [0, 130]
    assert keys_of(by_libvpx("times", 1_200_000, 4_000_000), {10: 250_000}, 20) == [0, 10]


@pytest.mark.parametrize(("follows", "keys"), [("times", [0, 30]), ("anew", [0, 30]), ("options", [0])])
def test_a_new_scene_is_a_key_frame_but_where_the_encoder_bounds_every_picture(follows: Any, keys: list[int]) -> None:
    encoder, found = by_libvpx(follows, 400_000, 400_000), []
    for number in range(40):
        picture = prepared_picture(np.full((240, 320), 40 if number < 30 else 200, np.uint8), 100 + number / 30)
        (packet,) = encoder.encode(picture, pts=cast(int, picture.pts), as_key=False)
        found += [number] if packet.is_keyframe else []
    assert found == keys


def test_until_it_begins_anew_an_encoder_goes_as_far_as_its_clock_reaches() -> None:
    encoder = by_libvpx("times", 50_000, 4_000_000)
    before = rate_bps(encoded(encoder, range(60))[20:])
    encoder.follow(2_000_000, moving(60).pts)
    assert rate_bps(encoded(encoder, range(60, 150))[20:]) > 3 * before


@pytest.mark.parametrize("is_asked", [False, True])
def test_another_scene_costs_no_more_than_a_key_frame_and_none_is_followed_by_another_burst(is_asked: bool) -> None:
    """Without one it takes four times as much; behind one made by the same libvpx the next picture takes up to twice
    that."""
    encoder = VideoEncoder(chosen_kind("VP8", "libvpx"), EncoderSettings(640, 480, 30.0, 1_000_000, 1_000_000))
    scenes = np.kron(RNG.integers(0, 256, (2, 60, 160, 3), dtype=np.uint8), np.ones((1, 8, 8, 1), np.uint8))
    noise = RNG.integers(0, 12, (7, 480, 640, 3), dtype=np.uint8)
    sizes = []
    for number in range(60):
        shifted = np.roll(scenes[0 if is_asked else number // 40], 2 * number, axis=1)[:, :640]
        picture = prepared_picture(shifted // 2 + noise[number % 7], 100 + number / 30)
        (packet,) = encoder.encode(picture, pts=cast(int, picture.pts), as_key=is_asked and number == 40)
        assert packet.is_keyframe is (number in (0, 40))
        sizes.append(packet.size)
    assert sizes[40] < 1.5 * sizes[0]
    assert max(sizes[41:44]) < sizes[0] / 2


def test_noise_is_spread_over_the_pictures_rather_than_spent_on_one_of_five(kind: EncoderKind) -> None:
    encoder = VideoEncoder(kind, EncoderSettings(320, 240, 30.0, 300_000, 300_000))
    sizes = [packet.size for packet in encoded(encoder, range(150))[40:]]
    assert max(sizes) < 3 * sum(sizes) / len(sizes)


@pytest.mark.parametrize("fps", [10.0, 60.0])
def test_a_source_of_another_rate_than_guessed_still_gets_its_bits(kind: EncoderKind, fps: float) -> None:
    encoder = VideoEncoder(kind, EncoderSettings(320, 240, 30.0, 400_000, 400_000))
    packets = encoded(encoder, range(int(6 * fps)), fps)
    assert 250_000 < rate_bps(packets[int(2 * fps) :], fps) < 520_000


def test_software_encoders_are_always_there() -> None:
    for codec in ("VP8", "H264"):
        assert chosen_kind(codec).codec == codec  # type: ignore[arg-type]
        assert not chosen_kind(codec, broken=[k.name for k in KINDS if k.is_hardware]).is_hardware  # type: ignore[arg-type]


def test_what_does_not_work_says_why() -> None:
    for kind in KINDS:
        probe = probed(kind)
        assert probe.works or len(probe.problem) > 10
        if not kind.is_hardware:
            assert probe.works


def test_vaapi_takes_pictures_in_its_own_memory_and_holds_none_back(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []

    def create(name: str, mode: str, hwaccel: Any = None) -> Any:
        asked.append(hwaccel)
        return SimpleNamespace(open=lambda: None)

    monkeypatch.setattr(av.CodecContext, "create", create)
    vaapi = [kind for kind in KINDS if "vaapi" in kind.name]
    assert [kind.name for kind in vaapi] == ["h264_vaapi", "vp8_vaapi"]
    for kind in vaapi:
        encoder = VideoEncoder(kind, EncoderSettings(320, 240, 30.0, 400_000, 400_000))
        assert isinstance(asked.pop(), HWAccel)
        assert encoder._context.pix_fmt == "nv12"
        assert encoder._context.options["async_depth"] == "1"
    VideoEncoder(KINDS[0], EncoderSettings(320, 240, 30.0, 400_000, 400_000))
    assert asked == [None]


def test_a_device_that_is_not_there_fails_its_probe_in_words() -> None:
    absent = EncoderKind(
        "h264_nvenc", "H264", "nv12", is_hardware=True, follows="anew", counts_pictures=True, device="cuda"
    )
    if not probed(KINDS[0]).works:  # no such GPU here
        assert "NVIDIA" in probed(absent).problem


def test_an_encoder_that_broke_is_not_chosen_again() -> None:
    with pytest.raises(EncoderUnavailable) as none_left:
        chosen_kind("VP8", broken=[kind.name for kind in KINDS])
    assert none_left.value.code == "media.no_encoder"


def test_a_robot_at_work_opens_no_software_encoder_to_see_whether_it_works(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(encoder_choice, "_probed", lambda kind: encoder_choice.Probe(kind, "opened"))
    assert {chosen_kind(codec, look=presumed).name for codec in ("VP8", "H264")} == {"libvpx", "libx264"}
    with pytest.raises(EncoderUnavailable):
        chosen_kind("VP8")


def test_a_wish_that_can_not_be_fulfilled_is_told_once(caplog: pytest.LogCaptureFixture) -> None:
    absent = EncoderKind("h264_nowhere", "H264", "yuv420p", is_hardware=True, follows="anew", counts_pictures=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(encoder_choice, "KINDS", (absent, *KINDS))
        assert {chosen_kind("H264", "h264_nowhere").name for _ in range(3)} == {chosen_kind("H264").name}
    assert [record.message.count("h264_nowhere") for record in caplog.records if "h264_nowhere" in record.message] == [
        1
    ]


def test_a_wish_for_a_working_one_is_fulfilled() -> None:
    assert chosen_kind("H264", "libx264").name == "libx264"
    assert chosen_kind("VP8", "libx264").codec == "VP8", "an encoder of another codec is no answer"


def test_speed_is_measured() -> None:
    speed = measured_speed(chosen_kind("VP8"), 320, 240, pictures=20)
    assert speed.fps > 5
    assert 0 < speed.median_ms <= speed.slow_ms


class OpenedContext:
    """A context of libav whose life can be watched."""

    def __init__(self, context: Any) -> None:
        self.__dict__["context"] = context

    def __getattr__(self, name: str) -> Any:
        return getattr(self.context, name)

    def __setattr__(self, name: str, value: object) -> None:
        setattr(self.context, name, value)


def test_an_encoder_made_anew_takes_memory_after_the_one_before_has_given_its_own_back(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    create = av.CodecContext.create
    alive: WeakSet[OpenedContext] = WeakSet()
    beside: list[int] = []

    def watched(*words: Any, **named: Any) -> OpenedContext:
        beside.append(len(alive))
        context = OpenedContext(create(*words, **named))
        alive.add(context)
        return context

    monkeypatch.setattr(av.CodecContext, "create", watched)
    encoder = VideoEncoder(
        next(kind for kind in KINDS if kind.name == "libvpx"), EncoderSettings(320, 240, 30.0, 400_000, 400_000)
    )
    for number in range(3):
        picture = moving(number)
        encoder.encode(picture, pts=picture.pts, as_key=True)
    assert beside == [0, 0, 0]
