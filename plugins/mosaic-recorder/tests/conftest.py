"""Encoded pictures that carry their number, taps that tests script, and a look into the files."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from pathlib import Path
from typing import Generic, Self, TypeVar

import av
import numpy as np
import pytest
from support.waiting import wait_for

from mosaic_camera.marks import draw_marks, read_marks
from mosaic_core.contract.media_tap import TapCodec, TappedImage, TappedPicture

Tapped = TypeVar("Tapped", TappedPicture, TappedImage)

FPS = 30
BEGAN_S = 5000.0
PATIENCE_S = 20.0


@lru_cache
def encoded(
    count: int, codec: TapCodec = "h264", size: tuple[int, int] = (320, 240), key_every: int = 1000
) -> tuple[TappedPicture, ...]:
    """``count`` pictures at 30 per second, numbered by marks, encoded as the robot does: no reordering."""
    width, height = size
    context = av.CodecContext.create("libx264" if codec == "h264" else "libvpx", "w")
    context.width, context.height, context.pix_fmt = width, height, "yuv420p"
    context.time_base, context.framerate = Fraction(1, 90_000), Fraction(FPS)
    context.bit_rate, context.max_b_frames, context.gop_size = 800_000, 0, key_every
    context.thread_count = 1  # several of libvpx wait for each other by turning round and round
    context.options = (
        {"preset": "superfast", "tune": "zerolatency", "x264-params": "scenecut=0"}
        if codec == "h264"
        else {"deadline": "realtime", "cpu-used": "8", "lag-in-frames": "0"}
    )
    pictures = []
    for number in range(count):
        image = np.full((height, width, 3), 60 + number % 100, dtype=np.uint8)
        draw_marks(image, number, number / FPS)
        frame = av.VideoFrame.from_ndarray(image, format="bgr24").reformat(format="yuv420p")
        frame.pts, frame.time_base = number * 3000, Fraction(1, 90_000)
        for packet in context.encode(frame):
            at_s = BEGAN_S + float((packet.pts or 0) * Fraction(1, 90_000))
            pictures.append(TappedPicture(bytes(packet), at_s, packet.is_keyframe, codec))
    assert len(pictures) == count
    return tuple(pictures)


@dataclass(frozen=True)
class Movie:
    """What a player finds in a file."""

    codec: str
    numbers: list[int | None]
    captured_s: list[float]
    """What the marks say, of those that can be read."""
    times_s: list[float]
    duration_s: float
    keys: int


def watched(path: Path) -> Movie:
    with av.open(str(path)) as container:
        frames = list(container.decode(video=0))
        marks = [read_marks(frame.to_ndarray(format="bgr24")) for frame in frames]
        return Movie(
            codec=container.streams.video[0].codec_context.name,
            numbers=[mark.frame if mark is not None else None for mark in marks],
            captured_s=[mark.captured_at_s for mark in marks if mark is not None],
            times_s=[float((frame.pts or 0) * (frame.time_base or 0)) for frame in frames],
            duration_s=(container.duration or 0) / 1e6,
            keys=sum(frame.key_frame for frame in frames),
        )


class ScriptedTap(Generic[Tapped]):
    """Gives pictures, then waits as a tap of a resting camera does; a test may add more, or let it fail."""

    def __init__(self, pictures: Sequence[Tapped] = (), failure: str = "") -> None:
        self.dropped = 0
        self.failure = failure
        self.key_frames_asked = 0
        self.is_open = False
        self._waiting = list(pictures)
        self._changed = threading.Condition()

    def give(self, *pictures: Tapped) -> None:
        with self._changed:
            self._waiting += pictures
            self._changed.notify_all()

    def wait_until_taken(self) -> None:
        with self._changed:
            assert self._changed.wait_for(lambda: not self._waiting, PATIENCE_S)

    def ask_key_frame(self) -> None:
        self.key_frames_asked += 1

    def next(self, timeout_s: float) -> Tapped | None:
        with self._changed:
            self._changed.wait_for(lambda: self._waiting or self.failure, timeout_s)
            picture = self._waiting.pop(0) if self._waiting else None
            self._changed.notify_all()
            return picture

    def __enter__(self) -> Self:
        self.is_open = True
        return self

    def __exit__(self, *_: object) -> None:
        self.is_open = False


def until(condition: Callable[[], object]) -> None:
    """Wait for what other threads do; fails after a while."""
    wait_for(condition, "what other threads do is done")


class Studio:
    """What the tests share."""

    BEGAN_S = BEGAN_S
    FPS = FPS
    Tap = ScriptedTap
    encoded = staticmethod(encoded)
    watched = staticmethod(watched)
    until = staticmethod(until)


@pytest.fixture
def studio() -> Studio:
    return Studio()
