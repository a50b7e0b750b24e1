"""A tap is one more viewer: it makes the camera run, starts at a key frame, and loses nothing without saying so."""

from __future__ import annotations

import asyncio
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

from mosaic_core.contract.media import EncodingParams
from mosaic_core.contract.media_tap import TappedPicture
from mosaic_core.laboratory.joining import until
from mosaic_core.machines.congestion.feedback import PictureLost
from mosaic_core.runtime.media import media_tap
from mosaic_core.runtime.media.media_hub import MediaHub
from mosaic_core.runtime.media.media_tap import RuntimeTap
from mosaic_core.runtime.media.plain_stream import plain_streams
from mosaic_core.runtime.observation.counters import ConnectorCounters


class Encoded:
    """What a stream hands to its feeds."""

    def __init__(self, number: int, *, is_key: bool = False, size: int = 10) -> None:
        self.pts, self.time_base = number * 3000, Fraction(1, 90_000)
        self.is_keyframe = is_key
        self._data = bytes([number]) * size

    def __bytes__(self) -> bytes:
        return self._data


class Bench:
    """A hub with the camera ``front``, and everything a tap of it gave."""

    def __init__(self) -> None:
        self.watched: list[tuple[str, bool]] = []
        self.loop = asyncio.get_running_loop()
        self.hub = MediaHub(
            plain_streams(lambda captured: captured.image), lambda label, on: self.watched.append((label, on))
        )
        self.hub.add_label("front", EncodingParams(), ConnectorCounters())

    def tap(self, label: str = "front") -> RuntimeTap:
        return RuntimeTap(self.loop, self.hub, label, "h264")

    async def show(self, *packets: Encoded) -> None:
        for packet in packets:
            assert self.hub.offer("front", packet)  # type: ignore[arg-type] # stands for an av.Packet
            for _ in range(3):  # through the hand-over, the feed and the pump
                await asyncio.sleep(0)


async def next_of(tap: RuntimeTap, timeout_s: float = 5.0) -> TappedPicture | None:
    return await asyncio.to_thread(tap.next, timeout_s)


async def test_the_camera_runs_for_the_tap_alone_and_rests_when_it_is_closed() -> None:
    bench = Bench()
    with bench.tap():
        await until(lambda: bench.watched == [("front", True)])
    await until(lambda: bench.watched == [("front", True), ("front", False)])


async def test_it_starts_with_a_key_frame_and_tells_the_time_of_capture() -> None:
    bench = Bench()
    with bench.tap() as tap:
        await until(lambda: bench.watched)
        await bench.show(Encoded(1), Encoded(2, is_key=True), Encoded(3))
        first, second = await next_of(tap), await next_of(tap)
        assert first == TappedPicture(b"\x02" * 10, 2 * 3000 / 90_000, True, "h264")
        assert second is not None
        assert (second.data, second.is_key) == (b"\x03" * 10, False)
        assert tap.dropped == 1


async def test_a_reader_that_is_too_slow_goes_on_at_a_key_frame_and_knows_what_it_missed(monkeypatch: Any) -> None:
    monkeypatch.setattr(media_tap, "MAX_WAITING_BYTES", 25)

    bench = Bench()
    with bench.tap() as tap:
        await until(lambda: bench.watched)
        await bench.show(Encoded(1, is_key=True), Encoded(2), Encoded(3), Encoded(4))
        assert [(await next_of(tap)), (await next_of(tap))] != [None, None]
        await bench.show(Encoded(5), Encoded(6, is_key=True))
        picture = await next_of(tap)
        assert picture is not None
        assert (picture.data[0], tap.dropped) == (6, 3)


def heard_by(bench: Bench, monkeypatch: Any) -> list[object]:
    """What the feeds of the bench are told."""
    heard: list[object] = []
    bind = bench.hub.bind

    def listening(*args: Any, **words: Any) -> Any:
        feed: Any = bind(*args, **words)
        monkeypatch.setattr(feed, "heard", heard.append)
        return feed

    monkeypatch.setattr(bench.hub, "bind", listening)
    return heard


async def test_its_reader_may_ask_for_a_key_frame_while_it_is_open(monkeypatch: Any) -> None:
    bench = Bench()
    heard = heard_by(bench, monkeypatch)
    with bench.tap() as tap:
        await until(lambda: bench.watched)
        tap.ask_key_frame()
        await until(lambda: heard == [PictureLost()])
    tap.ask_key_frame()
    await until(lambda: bench.watched[-1] == ("front", False))
    assert heard == [PictureLost()]


async def test_a_tap_that_dropped_asks_for_a_key_frame_as_soon_as_there_is_room(monkeypatch: Any) -> None:
    monkeypatch.setattr(media_tap, "MAX_WAITING_BYTES", 25)

    bench = Bench()
    heard = heard_by(bench, monkeypatch)
    with bench.tap() as tap:
        await until(lambda: bench.watched)
        await bench.show(Encoded(1, is_key=True), Encoded(2), Encoded(3))
        assert heard == []  # nothing could be taken yet
        assert await next_of(tap) is not None
        await bench.show(Encoded(4))
        assert heard == [PictureLost()]


async def test_an_unknown_label_is_said_at_once() -> None:
    bench = Bench()
    with bench.tap("frnt") as tap:
        assert await next_of(tap) is None
        assert tap.failure == "channel.unknown_label"
    assert bench.watched == []


async def test_nothing_for_a_while_is_none() -> None:
    bench = Bench()
    with bench.tap() as tap:
        assert await next_of(tap, 0.01) is None
        assert tap.failure == ""


def test_a_tap_of_a_robot_that_has_stopped_says_so() -> None:
    loop = asyncio.new_event_loop()
    loop.close()
    tap = RuntimeTap(loop, SimpleNamespace(), "front", "h264")  # type: ignore[arg-type] # never reached
    with tap:
        assert tap.next(0.01) is None
    assert tap.failure == "peer.shutdown"
