"""Encoder threads: the newest picture, key frames for those who ask, another encoder when one breaks."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from mosaic_core.adapters.video import encoder_thread
from mosaic_core.adapters.video.encoder_choice import EncoderUnavailable
from mosaic_core.adapters.video.encoder_set import EncoderSet
from mosaic_core.adapters.video.encoder_thread import EncodedRung, EncoderOrder, EncoderThread
from mosaic_core.adapters.video.picture import prepared_picture
from mosaic_core.adapters.video.picture_clock import pts_of
from mosaic_core.adapters.video.video_encoder import EncoderSettings, VideoEncoder
from mosaic_core.machines.media.rung_ladder import Rung

WAIT_S = 30.0
SETTINGS = EncoderSettings(64, 48, 30.0, 200_000, 200_000)


def picture(number: int, width: int = 64, height: int = 48) -> Any:
    return prepared_picture(np.full((height, width), number % 256, np.uint8), 10 + number / 30)


def pts(number: int) -> int:
    return pts_of(10 + number / 30)


class Outlet:
    """Listens to encoders."""

    def __init__(self) -> None:
        self.keys: queue.Queue[EncodedRung] = queue.Queue()
        self.packets: queue.Queue[Any] = queue.Queue()
        self.failures: queue.Queue[EncoderUnavailable] = queue.Queue()

    def encoded(self, key: EncodedRung, packet: Any) -> None:
        self.keys.put(key)
        self.packets.put(packet)

    def failed(self, key: EncodedRung, error: EncoderUnavailable) -> None:
        self.failures.put(error)

    def next(self) -> Any:
        return self.packets.get(timeout=WAIT_S)


@pytest.fixture
def outlet() -> Outlet:
    return Outlet()


@pytest.fixture
def start(outlet: Outlet) -> Iterator[Callable[..., EncoderThread]]:
    started: list[EncoderThread] = []

    def make(**order: Any) -> EncoderThread:
        key = EncodedRung("VP8", Rung(64, 48, order.pop("frame_step", 1), 100_000, 200_000))
        chosen = EncoderOrder("front", key, order.pop("settings", SETTINGS), **order)
        started.append(EncoderThread(chosen, outlet))
        return started[-1]

    yield make
    for thread in started:
        thread.close()
        thread.join(WAIT_S)


def test_pictures_of_any_size_come_out_in_the_rungs_size(start: Any, outlet: Outlet) -> None:
    thread = start()
    for number, size in enumerate(((64, 48), (128, 96), (320, 240))):
        thread.offer(picture(number, *size))
        packet = outlet.next()
        assert packet.pts == pts(number)
        assert packet.is_keyframe is (number == 0)
    assert thread.encoded == 3


class Held:
    """Stands in for encoding that takes as long as the test wants."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.began = threading.Semaphore(0)
        self.may_end = threading.Semaphore(0)
        encode = VideoEncoder.encode

        def held(encoder: VideoEncoder, *args: Any, **options: Any) -> Any:
            self.began.release()
            assert self.may_end.acquire(timeout=WAIT_S)
            return encode(encoder, *args, **options)

        patch.setattr(encoder_thread.VideoEncoder, "encode", held)


def test_an_encoder_that_is_slower_than_the_camera_leaves_out_the_older_pictures(
    start: Any, outlet: Outlet, monkeypatch: pytest.MonkeyPatch
) -> None:
    thread = start()
    thread.offer(picture(0))
    outlet.next()
    held = Held(monkeypatch)
    thread.offer(picture(1))
    assert held.began.acquire(timeout=WAIT_S)
    for number in range(2, 6):
        thread.offer(picture(number))
    held.may_end.release(2)
    assert [outlet.next().pts for _ in range(2)] == [pts(1), pts(5)]
    assert thread.skipped == 3


def test_a_rung_of_every_second_picture_takes_every_second(start: Any, outlet: Outlet) -> None:
    thread = start(frame_step=2)
    for number in range(6):
        thread.offer(picture(number))
        if number % 2 == 0:
            assert outlet.next().pts == pts(number)
    assert outlet.packets.empty()


def test_whoever_asks_gets_a_key_frame_and_a_slow_source_is_not_waited_for(start: Any, outlet: Outlet) -> None:
    thread = start()
    thread.offer(picture(0))
    assert outlet.next().is_keyframe
    thread.ask_key_frame()
    again = outlet.next()  # no new picture came: the last one again
    assert again.is_keyframe
    assert again.pts > pts(0)


def test_an_encoder_that_breaks_is_replaced(
    start: Any, outlet: Outlet, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    asked: list[tuple[str, ...]] = []
    choose, encode = encoder_thread.chosen_kind, VideoEncoder.encode

    def choosing(codec: Any, wanted: str, *, broken: Any = (), **more: Any) -> Any:
        asked.append(tuple(broken))
        return choose(codec, wanted, **more)

    def breaking(encoder: VideoEncoder, *args: Any, **options: Any) -> Any:
        if len(asked) == 1:
            raise ValueError("the driver is gone")
        return encode(encoder, *args, **options)

    monkeypatch.setattr(encoder_thread, "chosen_kind", choosing)
    monkeypatch.setattr(encoder_thread.VideoEncoder, "encode", breaking)
    thread = start()
    thread.offer(picture(0))
    while outlet.packets.empty():
        thread.offer(picture(1))
    assert outlet.next().is_keyframe
    assert asked == [(), ("libvpx",)]
    assert any("the driver is gone" in record.message for record in caplog.records)


def test_without_any_encoder_it_says_so_and_ends(start: Any, outlet: Outlet, monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(*_: Any, **__: Any) -> Any:
        raise EncoderUnavailable("none", code="media.no_encoder")

    monkeypatch.setattr(encoder_thread, "chosen_kind", nothing)
    start()
    assert outlet.failures.get(timeout=WAIT_S).code == "media.no_encoder"


def test_a_set_runs_exactly_what_is_used_and_a_new_one_begins_with_the_latest_picture(outlet: Outlet) -> None:
    encoders = EncoderSet(outlet)
    keys = [EncodedRung("VP8", Rung(width, 48, 1, 100_000, 200_000)) for width in (64, 32)]
    orders = {
        key: EncoderOrder("front", key, EncoderSettings(key.rung.width, 48, 30.0, 200_000, 200_000)) for key in keys
    }
    try:
        encoders.offer(picture(0))
        encoders.use({keys[0]: orders[keys[0]]})
        packet = outlet.next()
        assert (outlet.keys.get(), packet.is_keyframe) == (keys[0], True)
        encoders.use(orders)
        packet = outlet.next()
        assert (outlet.keys.get(), packet.is_keyframe, packet.pts) == (keys[1], True, pts(0))
        encoders.use({keys[1]: orders[keys[1]]})
        assert encoders.running == (keys[1],)
        encoders.offer(picture(1))
        assert outlet.keys.get(timeout=WAIT_S) == keys[1]
        assert encoders.cpu_s > 0
    finally:
        encoders.close()
    assert encoders.running == ()
    assert encoders.take_skipped() == 0
