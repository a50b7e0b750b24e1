"""What a camera or a microphone returns instead of yielding, or yields and is none, is told with class and line."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import AsyncIterator, Callable, Iterator
from types import ModuleType
from typing import Any

import av
import numpy as np
import pytest

from mosaic_core import AudioTrackHandler, Captured, MediaTrackHandler, MosaicError, Sound
from mosaic_core.contract.declared.sent_picture import check_picture
from mosaic_core.testing import fake_host, take_frames, take_sounds

GOOD = np.zeros((4, 6, 3), np.uint8)


class Returning(MediaTrackHandler):
    def __init__(self, made: Callable[[], Any]) -> None:
        super().__init__("eye")
        self.made = made

    def frames(self) -> Any:
        return self.made()


async def later() -> AsyncIterator[Any]:
    yield GOOD


async def awaited() -> Any:
    raise AssertionError("nobody awaits it")


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (lambda: GOOD, "ndarray uint8 (4, 6, 3), and no stream. Let it yield one after the other: `yield` instead of"),
        (lambda: [GOOD, GOOD], "list, and no stream. Let it yield"),
        (lambda: (GOOD,), "tuple, and no stream. Let it yield"),
        (lambda: b"jpeg", "bytes, and no stream. Let it yield"),
        (lambda: Captured(GOOD, 1.0), "Captured, and no stream. Let it yield"),
        (lambda: None, "NoneType, and nothing to send. Let it yield."),
        (later, "async_generator, which only `async for` iterates. Write `async def`"),
        (awaited, "coroutine, and no stream."),
    ],
)
def test_pictures_are_yielded_and_not_returned(made: Callable[[], Any], said: str) -> None:
    with pytest.raises(MosaicError) as caught:
        take_frames(Returning(made), 1)
    place = f"{__file__}:{Returning.frames.__code__.co_firstlineno}"
    assert caught.value.message.startswith(f"Returning.frames() ({place}) returned {said}")
    assert caught.value.code == "plugin.wrong_message"


def test_what_iterates_them_one_by_one_may_be_returned() -> None:
    assert len(take_frames(Returning(lambda: map(np.copy, [GOOD, GOOD])), 2)) == 2
    assert take_frames(MediaTrackHandler("pushes alone")) == []


def test_a_microphone_yields_too() -> None:
    class Ear(AudioTrackHandler):
        def sounds(self) -> Any:
            return [Sound(np.zeros((960, 1), np.int16), 48_000, 0.0)]

    with pytest.raises(MosaicError, match=r"Ear\.sounds\(\) \(.*\) returned list, and no stream"):
        take_sounds(Ear("ear"), 1)


class Yielding(MediaTrackHandler):
    def __init__(self, picture: Any) -> None:
        super().__init__("eye")
        self.picture = picture

    def frames(self) -> Iterator[Any]:
        yield GOOD
        yield self.picture


class YieldingTask(Yielding):
    async def frames(self) -> AsyncIterator[Any]:  # type: ignore[override]
        yield GOOD
        yield self.picture


@pytest.mark.parametrize("kind", [Yielding, YieldingTask])
@pytest.mark.parametrize(
    ("picture", "what", "cure"),
    [
        (np.zeros((4, 6, 3), np.float32), "ndarray float32 (4, 6, 3)", ".astype(np.uint8)"),
        (Captured(np.zeros((4, 6)), 1.0), "ndarray float64 (4, 6)", ".astype(np.uint8)"),  # type: ignore[arg-type]
        (np.zeros((4, 6, 2), np.uint8), "ndarray uint8 (4, 6, 2)", "three channels, or none"),
        (np.zeros((4, 6, 4), np.uint8), "ndarray uint8 (4, 6, 4)", "picture[..., :3]"),
        (np.zeros((4, 6, 1), np.uint8), "ndarray uint8 (4, 6, 1)", "picture[..., 0]"),
        (np.zeros((3, 4, 6), np.uint8), "ndarray uint8 (3, 4, 6)", "picture.transpose(1, 2, 0)"),
        (np.zeros(6, np.uint8), "ndarray uint8 (6,)", "three channels, or none"),
        (np.zeros((1, 6), np.uint8), "ndarray uint8 (1, 6)", "at least 2 x 2 pixels"),
        ([[0, 0], [0, 0]], "list", "`Captured`, an `av.VideoFrame` or an `av.Packet`"),
        (None, "NoneType", "`Captured`, an `av.VideoFrame` or an `av.Packet`"),
    ],
)
def test_what_is_no_picture_is_told_with_its_shape_and_line(kind: Any, picture: Any, what: str, cure: str) -> None:
    with pytest.raises(MosaicError) as caught:
        take_frames(kind(picture), 2)
    line = kind.frames.__code__.co_firstlineno + 2
    taken = "a picture is uint8 (height, width, 3) in BGR order, or (height, width) for gray"
    assert caught.value.message.startswith(f"{kind.__name__} ({__file__}:{line}) sends {what}; {taken}. ")
    assert caught.value.code == "plugin.wrong_message"
    assert cure in caught.value.message


@pytest.mark.parametrize(
    "picture",
    [
        np.zeros((2, 2), np.uint8),
        np.zeros((3, 3, 3), np.uint8),
        GOOD[..., ::-1],
        Captured(GOOD, 1.0),
        av.VideoFrame(4, 6, "yuv420p"),
        av.Packet(b"encoded"),
    ],
)
def test_what_is_a_picture_is_taken(picture: Any) -> None:
    assert take_frames(Yielding(picture), 2)[1] is picture


@pytest.mark.parametrize(
    ("stamp_s", "said"),
    [(time.time(), "a time of the wall clock"), (math.nan, "no finite number")],
    ids=["wall", "nan"],
)
def test_a_time_of_another_clock_is_told_with_its_line(stamp_s: float, said: str) -> None:
    """Commands are gated on how old the picture is that their operator sees."""
    with pytest.raises(MosaicError) as caught:
        take_frames(Yielding(Captured(GOOD, stamp_s)), 2)
    assert caught.value.message.startswith(f"Yielding ({__file__}:")
    assert f"says captured_at_s={stamp_s:.3f}, {said}. Take it from `self.monotonic_s()`" in caught.value.message
    assert caught.value.code == "plugin.wrong_message"


def test_a_board_whose_wall_clock_was_never_set_shows_its_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(time, "time", time.monotonic)
    assert len(take_frames(Yielding(Captured(GOOD, time.monotonic())), 2)) == 2


def test_the_line_of_a_picture_that_is_pushed_is_that_of_the_push() -> None:
    eye = Yielding(GOOD)
    fake_host(eye).accepts = False
    with pytest.raises(MosaicError) as caught:
        eye.send_frame("picture.png")  # type: ignore[arg-type]
    line = caught.traceback[0].lineno + 1
    assert caught.value.message.startswith(f"Yielding ({__file__}:{line}) sends str; ")


class Humming(AudioTrackHandler):
    def __init__(self, sound: Any) -> None:
        super().__init__("ear")
        self.sound = sound

    def sounds(self) -> Iterator[Any]:
        yield self.sound


@pytest.mark.parametrize(
    ("sound", "said"),
    [
        (np.zeros((960, 1), np.int16), "ndarray int16 (960, 1), and no `Sound(samples, rate_hz, captured_at_s)`"),
        (Sound(np.zeros((960, 1), np.float32), 48_000, 0.0), "a sound of ndarray float32 (960, 1); it must be int16"),  # type: ignore[arg-type]
        (Sound(np.zeros(960, np.int16), 48_000, 0.0), "a sound of ndarray int16 (960,); it must be int16 samples of"),
        (Sound(np.zeros((960, 0), np.int16), 48_000, 0.0), "a sound of ndarray int16 (960, 0); it must be"),
        (Sound(np.zeros((960, 1), np.int16), 48, 0.0), "a sound whose rate of 48 Hz is out of range (4000 to 384000)"),
    ],
)
def test_what_is_no_sound_is_told_with_its_shape_and_line(sound: Any, said: str) -> None:
    with pytest.raises(MosaicError) as caught:
        take_sounds(Humming(sound), 1)
    place = f"{__file__}:{Humming.sounds.__code__.co_firstlineno + 1}"
    assert caught.value.message.startswith(f"Humming ({place}) sends {said}")


def test_a_library_that_another_thread_still_loads_has_no_classes_yet(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "av", ModuleType("av"))
    check_picture(MediaTrackHandler, np.zeros((4, 6, 3), np.uint8))
    with pytest.raises(MosaicError, match="sends str"):
        check_picture(MediaTrackHandler, "no picture")
