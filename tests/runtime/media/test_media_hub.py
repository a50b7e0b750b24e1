"""Who watches what: streams run for viewers only, and viewers that leave take everything with them."""

from __future__ import annotations

import asyncio
import threading
from typing import Any

import numpy as np
import pytest

from mosaic_core import Captured, EncodingParams, MediaTrackHandler
from mosaic_core.runtime.media.media_hub import MediaHub
from mosaic_core.runtime.media.plain_stream import NewestFeed, plain_streams
from mosaic_core.runtime.observation.counters import ConnectorCounters

PICTURE = np.zeros((2, 2), np.uint8)


def hub(prepared: list[Any], watched: list[tuple[str, bool]]) -> MediaHub:
    def prepare(captured: Captured) -> Any:
        prepared.append((threading.current_thread().name, captured.captured_at_s))
        return len(prepared)

    it = MediaHub(plain_streams(prepare), lambda label, on: watched.append((label, on)))
    it.add_label("front", EncodingParams(), ConnectorCounters())
    return it


def silent(code: str) -> None:
    raise AssertionError(code)


async def test_one_conversion_on_the_handlers_thread_serves_all_viewers(kit: Any) -> None:
    prepared: list[Any] = []
    watched: list[tuple[str, bool]] = []
    it = hub(prepared, watched)
    assert it.offer("front", PICTURE) is False
    feeds = [it.bind(peer_id, "front", silent) for peer_id in ("p1", "p2", "p3")]
    for peer_id in ("p1", "p2"):
        it.watch(peer_id, "front", True)
        it.watch(peer_id, "front", True)
    assert await asyncio.to_thread(it.offer, "front", Captured(PICTURE, 7.5)) is True
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
    assert it.is_bound("p2", "front")
    assert it.offer("front", PICTURE) is False
    it.close()


async def test_a_viewer_that_is_slow_sees_the_newest_picture(kit: Any) -> None:
    feed = NewestFeed()
    assert [feed.put(number) for number in range(5)] == [False, True, True, True, True]
    assert await feed.next() == 4
    waiting = asyncio.ensure_future(feed.next())
    await asyncio.sleep(0)
    feed.put(9)
    assert await waiting == 9


async def test_a_viewer_that_looks_again_is_not_shown_an_old_picture(kit: Any) -> None:
    prepared: list[Any] = []
    it = hub(prepared, [])
    feed = it.bind("p1", "front", silent)
    it.watch("p1", "front", True)
    it.offer("front", PICTURE)
    await asyncio.sleep(0)
    it.watch("p1", "front", False)
    it.watch("p1", "front", True)
    it.offer("front", PICTURE)
    assert await feed.next() == 2


class Encoding(MediaTrackHandler):
    packet_codec = "h264"


async def test_the_codec_that_a_handler_declares_reaches_the_stream(kit: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    told: dict[str, object] = {}
    add_label = MediaHub.add_label

    def noting(hub: MediaHub, label: str, *words: Any) -> None:
        told[label] = words[-1]
        add_label(hub, label, *words)

    monkeypatch.setattr(MediaHub, "add_label", noting)

    async with kit.running(kit.connector_of(Encoding("front")), kit.connector_of(MediaTrackHandler("rear"))):
        await kit.until(lambda: told == {"front": "h264", "rear": None})
