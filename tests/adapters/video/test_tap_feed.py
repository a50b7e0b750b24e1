"""A tap's feed: nobody looks at it live, so that a busy event loop costs it no picture."""

from __future__ import annotations

from typing import Any

import av
import pytest

from mosaic_core.adapters.video.viewer_feed import MAX_WAITING, MAX_WAITING_LOCAL, ViewerFeed


def packet(number: int, *, is_key: bool = False) -> av.Packet[Any]:
    made: av.Packet[Any] = av.Packet(b"\x00\x00\x01\x65")
    made.pts, made.is_keyframe = number, is_key
    return made


def feed(*, is_local: bool) -> tuple[ViewerFeed, list[ViewerFeed]]:
    asked: list[ViewerFeed] = []
    return ViewerFeed((), lambda code: None, asked.append, lambda: None, is_local), asked


async def all_of(viewer: ViewerFeed, count: int) -> list[int | None]:
    return [(await viewer.next()).pts for _ in range(count)]


@pytest.mark.parametrize(("is_local", "dropped", "left"), [(True, 0, [0, 1, 2]), (False, 2, [2])])
async def test_a_key_frame_replaces_what_waits_for_an_operator_but_not_for_a_tap(
    is_local: bool, dropped: int, left: list[int]
) -> None:
    viewer, _ = feed(is_local=is_local)
    viewer.put(packet(0, is_key=True))
    viewer.put(packet(1))
    assert viewer.put(packet(2, is_key=True)) == dropped
    assert await all_of(viewer, len(left)) == left


async def test_two_seconds_of_a_busy_event_loop_lose_a_tap_nothing_and_more_makes_it_ask_for_a_key_frame() -> None:
    assert MAX_WAITING_LOCAL > MAX_WAITING
    viewer, asked = feed(is_local=True)
    for number in range(MAX_WAITING_LOCAL):
        assert viewer.put(packet(number, is_key=number == 0)) == 0
    assert asked == []
    assert viewer.put(packet(MAX_WAITING_LOCAL)) == MAX_WAITING_LOCAL + 1
    assert asked == [viewer]
