"""Pictures are converted once, keep their content and their time, and are safe to share."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import av
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.adapters.video.picture import own_frame, prepared_picture, scaled_picture
from mosaic_core.adapters.video.picture_clock import VIDEO_TIME_BASE, pts_of, stamped


def colours(height: int = 48, width: int = 64) -> np.ndarray[Any, Any]:
    image = np.zeros((height, width, 3), np.uint8)
    image[:, : width // 2] = (200, 40, 90)
    image[:, width // 2 :] = (30, 180, 220)
    return image


def distance(frame: Any, image: np.ndarray[Any, Any]) -> float:
    return float(np.abs(frame.to_ndarray(format="bgr24").astype(int) - image).mean())


def test_a_bgr_image_becomes_yuv420p_with_the_same_colours() -> None:
    frame = prepared_picture(colours(), 2.0)
    assert isinstance(frame, av.VideoFrame)
    assert (frame.format.name, frame.width, frame.height) == ("yuv420p", 64, 48)
    assert distance(frame, colours()) < 4


def test_a_gray_image_stays_gray() -> None:
    gray = np.tile(np.arange(0, 256, 4, dtype=np.uint8), (32, 1))
    frame = prepared_picture(gray, 0.0)
    assert distance(frame, np.repeat(gray[:, :, None], 3, axis=2)) < 3


@pytest.mark.parametrize("height", [46, 48, 50, 2, 30])
def test_every_even_height_keeps_its_rows_and_colours(height: int) -> None:
    shared = prepared_picture(colours(height), 1.0)
    for frame in (shared, own_frame(shared)):
        assert isinstance(frame, av.VideoFrame)
        assert (frame.width, frame.height) == (64, height)
        assert distance(frame, colours(height)) < 4


@pytest.mark.parametrize(("height", "width"), [(49, 65), (49, 64), (48, 65)])
def test_an_odd_row_or_column_is_cut_off(height: int, width: int) -> None:
    for picture in (colours(height, width), av.VideoFrame.from_ndarray(colours(height, width), format="bgr24")):
        frame = prepared_picture(picture, 0.0)
        assert isinstance(frame, av.VideoFrame)
        assert (frame.width, frame.height) == (64, 48)
        assert distance(frame, colours(height, width)[:48, :64]) < 4


def test_a_view_with_gaps_is_taken_too() -> None:
    flipped = colours()[::-1, ::-1]
    assert distance(prepared_picture(flipped, 0.0), flipped) < 4


def test_a_frame_of_another_format_is_converted() -> None:
    frame = prepared_picture(av.VideoFrame.from_ndarray(colours(), format="bgr24"), 1.0)
    assert isinstance(frame, av.VideoFrame)
    assert frame.format.name == "yuv420p"
    assert distance(frame, colours()) < 4


def test_the_time_of_capture_is_its_time() -> None:
    frame = prepared_picture(colours(), 3.5)
    assert frame.pts == pts_of(3.5) == 315_000
    assert frame.time_base == Fraction(1, 90_000)


def test_a_packet_is_stamped_as_it_is() -> None:
    packet: av.Packet[Any] = av.Packet(b"\x00\x00\x00\x01\x67")
    assert stamped(packet, 2.0) is packet
    assert (packet.pts, packet.time_base) == (180_000, VIDEO_TIME_BASE)


def test_every_encoder_gets_a_frame_of_its_own_around_the_same_pixels() -> None:
    shared = prepared_picture(colours(), 7.0)
    first, second = own_frame(shared), own_frame(shared)
    assert isinstance(first, av.VideoFrame)
    assert first is not second
    encoder = av.CodecContext.create("libvpx", "w")
    encoder.width, encoder.height, encoder.pix_fmt = 64, 48, "yuv420p"
    encoder.time_base = Fraction(1, 30)
    list(encoder.encode(first))
    assert (second.pts, second.time_base) == (pts_of(7.0), VIDEO_TIME_BASE)
    assert (shared.pts, shared.time_base) == (pts_of(7.0), VIDEO_TIME_BASE)
    assert distance(second, colours()) < 4


@pytest.mark.parametrize(
    "picture",
    [
        "picture.png",
        np.zeros((4, 4), np.float32),
        np.zeros((4, 4, 4), np.uint8),
        np.zeros((4,), np.uint8),
        np.zeros((1, 8, 3), np.uint8),
    ],
)
def test_what_is_no_picture_is_refused_in_words(picture: Any) -> None:
    with pytest.raises(TypeError, match="picture"):
        prepared_picture(picture, 0.0)


@given(st.floats(min_value=0, max_value=1e7))
def test_timestamps_are_exact_in_ticks_and_in_microseconds(captured_at_s: float) -> None:
    pts = pts_of(captured_at_s)
    assert abs(pts / 90_000 - captured_at_s) <= 51e-6
    assert (pts * 1_000_000) % 90_000 == 0


@pytest.mark.parametrize("size", [(32, 24), (64, 48), (128, 96), (42, 30)])
def test_a_scaled_picture_keeps_its_colours_and_its_time(size: tuple[int, int]) -> None:
    shared = prepared_picture(colours(), 7.0)
    assert isinstance(shared, av.VideoFrame)
    scaled = scaled_picture(shared, *size)
    assert (scaled.width, scaled.height, scaled.pts) == (*size, pts_of(7.0))
    left, right = scaled.to_ndarray(format="bgr24")[2, 2], scaled.to_ndarray(format="bgr24")[2, -3]
    assert np.abs(left.astype(int) - (200, 40, 90)).max() < 12
    assert np.abs(right.astype(int) - (30, 180, 220)).max() < 12
    assert distance(shared, colours()) < 4
