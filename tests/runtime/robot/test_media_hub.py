"""Pictures: converted once, newest first, and nothing for nobody."""

from __future__ import annotations

import asyncio
import threading
from dataclasses import dataclass
from typing import Any

import numpy as np

from mosaic_core import Captured
from mosaic_core.runtime.counters import ConnectorCounters
from mosaic_core.runtime.media_hub import MediaHub, NewestFeed

PICTURE = np.zeros((2, 2), np.uint8)


@dataclass
class Packet:
    number: int
    is_keyframe: bool


def hub(prepared: list[Any], watched: list[tuple[str, bool]]) -> MediaHub:
    def prepare(picture: Any, captured_at_s: float) -> Any:
        prepared.append((threading.current_thread().name, captured_at_s))
        return len(prepared)

    it = MediaHub(asyncio.get_running_loop(), prepare, lambda label, on: watched.append((label, on)))
    it.add_label("front", ConnectorCounters())
    return it


def test_one_conversion_on_the_handlers_thread_serves_all_viewers(kit: Any) -> None:
    async def body() -> None:
        prepared: list[Any] = []
        watched: list[tuple[str, bool]] = []
        it = hub(prepared, watched)
        assert it.post("front", PICTURE) is False
        feeds = [it.bind(peer_id, "front") for peer_id in ("p1", "p2", "p3")]
        for peer_id in ("p1", "p2"):
            it.watch(peer_id, "front", True)
            it.watch(peer_id, "front", True)
        assert await asyncio.to_thread(it.post, "front", Captured(PICTURE, 7.5)) is True
        assert [await feed.next() for feed in feeds[:2]] == [1, 1]
        assert len(prepared) == 1
        assert prepared[0][0] != threading.current_thread().name
        assert prepared[0][1] == 7.5
        assert it.viewers("front") == 2
        assert it.watched_by("p1") == ("front",)
        it.leave("p1")
        it.watch("p2", "front", False)
        assert watched == [("front", True), ("front", False)]
        assert not it.is_bound("p1", "front")

    kit.play(body)


def test_a_viewer_that_is_slow_sees_the_newest_picture(kit: Any) -> None:
    async def body() -> None:
        feed = NewestFeed()
        for number in range(5):
            feed.put(number)
        assert await feed.next() == 4
        assert feed.dropped == 4
        waiting = asyncio.ensure_future(feed.next())
        await asyncio.sleep(0)
        feed.put(9)
        assert await waiting == 9

    kit.play(body)


def test_encoded_packets_start_at_a_key_frame_and_are_never_torn(kit: Any) -> None:
    async def body() -> None:
        feed = NewestFeed()
        feed.put(Packet(0, False))
        feed.put(Packet(1, True))
        feed.put(Packet(2, False))
        assert [(await feed.next()).number for _ in range(2)] == [1, 2]
        for number in range(3, 70):
            feed.put(Packet(number, False))
        feed.put(Packet(70, True))
        assert (await feed.next()).number == 70, "after an overflow it starts over"
        feed.put(Packet(71, False))
        feed.clear()
        feed.put(Packet(72, False))
        feed.put(Packet(73, True))
        assert (await feed.next()).number == 73

    kit.play(body)


def test_a_stream_of_key_frames_only_stays_bounded() -> None:
    feed = NewestFeed()
    for number in range(1000):
        feed.put(Packet(number, True))
    assert len(feed._items) <= 60
