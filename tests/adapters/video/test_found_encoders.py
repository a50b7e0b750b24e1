"""What encodes on this machine: found once in the background, told in one line, and decisive for the first codec."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest

from mosaic_core.adapters.video.encoder_choice import KINDS, EncoderUnavailable
from mosaic_core.adapters.video.found_encoders import FoundEncoders
from mosaic_core.adapters.video.video_encoder import EncoderKind

BY_NAME = {kind.name: kind for kind in KINDS}
WAIT_S = 30.0


def choosing(*names: str) -> Callable[[str], EncoderKind]:
    kinds = {BY_NAME[name].codec: BY_NAME[name] for name in names}

    def choose(codec: str) -> EncoderKind:
        if codec not in kinds:
            raise EncoderUnavailable(f"no encoder for {codec}", code="media.no_encoder")
        return kinds[codec]  # type: ignore[index]

    return choose


def found(choose: Any) -> FoundEncoders:
    encoders = FoundEncoders(choose)
    encoders.seek()
    join_search()
    return encoders


def join_search() -> None:
    for thread in threading.enumerate():
        if thread.name == "probe encoders":
            thread.join(WAIT_S)


@pytest.fixture(autouse=True)
def at_info(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO, "mosaic_core.adapters.video.found_encoders")


@pytest.mark.parametrize(
    ("names", "first"),
    [
        (("libx264", "libvpx"), "VP8"),
        (("h264_nvenc", "libvpx"), "H264"),
        (("h264_v4l2m2m", "vp8_v4l2m2m"), "VP8"),
        (("libx264", "vp8_v4l2m2m"), "VP8"),
        (("h264_qsv",), "H264"),
        (("libx264",), "VP8"),
        ((), "VP8"),
    ],
)
def test_h264_comes_first_where_only_that_is_encoded_in_hardware(names: tuple[str, ...], first: str) -> None:
    assert FoundEncoders(choosing(*names)).preferred_codec == "VP8", "while nothing is known"
    assert found(choosing(*names)).preferred_codec == first


def test_one_line_names_both_and_the_encoders_that_begin_add_none(caplog: pytest.LogCaptureFixture) -> None:
    encoders = found(choosing("h264_nvenc", "libvpx"))
    for name in ("libvpx", "h264_nvenc", "libvpx"):
        encoders.began(BY_NAME[name])
    (line,) = caplog.messages
    assert line.startswith("pictures are encoded as H264 by h264_nvenc in hardware and VP8 by libvpx in software")


def test_encoders_that_begin_during_the_search_are_told_once_all_the_same(caplog: pytest.LogCaptureFixture) -> None:
    may_end = threading.Event()
    choose = choosing("libx264", "libvpx")

    def slowly(codec: Any) -> EncoderKind:
        assert may_end.wait(WAIT_S)
        return choose(codec)

    encoders = FoundEncoders(slowly)
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda _: encoders.seek(), range(8)))
        list(pool.map(encoders.began, [BY_NAME["libx264"], BY_NAME["h264_amf"]] * 8))
    assert caplog.messages == []
    may_end.set()
    join_search()
    assert len(caplog.messages) == 2
    assert "VP8 by libvpx in software and H264 by libx264 in software" in caplog.messages[0]
    assert "H264 is encoded by h264_amf in hardware" in caplog.messages[1], "named by a camera"


def test_another_encoder_that_takes_over_is_told_once(caplog: pytest.LogCaptureFixture) -> None:
    encoders = found(choosing("h264_nvenc", "libvpx"))
    caplog.clear()
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(encoders.began, [BY_NAME["libx264"]] * 16))
    assert caplog.messages == ["H264 is encoded by libx264 in software"]


def test_a_codec_without_an_encoder_is_told_as_an_error(caplog: pytest.LogCaptureFixture) -> None:
    found(choosing("libvpx"))
    error, line = caplog.records
    assert (error.levelname, error.message) == ("ERROR", "no encoder for H264")
    assert "VP8 by libvpx" in line.message
