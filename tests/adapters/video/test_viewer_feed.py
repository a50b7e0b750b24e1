"""One viewer whose receiver tells of every packet: pauses while a queue drains, repeats and copies what gets lost."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import av
import pytest

from mosaic_core.adapters.video.viewer_feed import USUAL_PX, ViewerFeed
from mosaic_core.machines.congestion.path_watch import PathSeen
from mosaic_core.machines.media.rung_ladder import Rung
from mosaic_core.runtime.transport.peer_congestion import PeerCongestion

RUNG = Rung(640, 360, 1, 150_000, 2_000_000)
NOW_S = 1e9
"""Later than any cut."""


class Wishes:
    """What a feed asks of its stream."""

    def __init__(self) -> None:
        self.keys = self.changes = 0
        self.asked = asyncio.Event()

    def key(self, _: ViewerFeed) -> None:
        self.keys += 1
        self.asked.set()

    def changed(self) -> None:
        self.changes += 1


def packet(*, is_key: bool = False) -> av.Packet[Any]:
    made: av.Packet[Any] = av.Packet(b"\x00" * 500)
    made.is_keyframe = is_key
    return made


def seen(*, lost: int = 0, queue_s: float = 0.0, path_bps: float | None = None, empties_in_s: float = 0.0) -> PathSeen:
    return PathSeen(queue_s, queue_s, NOW_S, 30 - lost, lost, empties_in_s, path_bps, None)


@asynccontextmanager
async def with_feed() -> AsyncIterator[tuple[ViewerFeed, Wishes]]:
    wishes = Wishes()
    feed = ViewerFeed(("video/VP8",), lambda code: None, wishes.key, wishes.changed)
    feed.begin([("rung", RUNG)], (150_000, 2_000_000), 0.0)
    feed.switch.want("rung")
    feed.switch.taken("rung", packet(is_key=True), is_key=True, captured_at=0)
    yield feed, wishes
    feed.pause()


def congested(feed: ViewerFeed) -> None:
    """The reports of a queue."""
    for _ in range(2):
        feed.heard(seen(queue_s=0.2, path_bps=300_000, empties_in_s=0.15))


async def test_while_a_queue_drains_nothing_leaves_and_then_what_waited_does_without_a_key_frame() -> None:
    async with with_feed() as (feed, wishes):
        feed.heard(seen())
        changes = wishes.changes
        congested(feed)
        assert feed.budget_bps == 240_000
        assert feed.connection.is_paused
        assert wishes.changes == changes + 1
        leaving = asyncio.create_task(feed.next())
        await asyncio.sleep(0)
        feed.put(packet())
        await asyncio.sleep(0.01)
        assert not leaving.done()
        assert await asyncio.wait_for(leaving, 30)
        assert not feed.connection.is_paused
        assert wishes.changes == changes + 2, "it is told when it may go on"
        assert wishes.keys == 0
        assert feed.switch.needs_key is None


async def test_two_cameras_of_one_operator_share_its_budget_and_what_one_leaves_is_the_other_s() -> None:
    async with with_feed() as (front, _), with_feed() as (rear, told):
        connection = PeerCongestion()
        for feed in (front, rear):
            feed.pause()
            feed.send_over(connection)
            feed.begin([("rung", RUNG)], (150_000, 2_000_000), 0.0)
        front.heard(seen())
        congested(front)
        assert front.budget_bps + rear.budget_bps == pytest.approx(300_000, abs=2), "nobody gets less than its least"
        changes = told.changes
        front.pause()
        assert front.budget_bps == 0
        assert rear.budget_bps >= 240_000
        assert told.changes > changes


async def test_on_a_lossy_path_packets_are_sent_twice_and_repeats_too() -> None:
    async with with_feed() as (feed, _):
        assert feed.repeats(1) == 1
        assert not any(feed.wants_copy(number, 1000) for number in range(10))
        for _lost in range(10):
            feed.heard(seen(lost=1))
        copied = False
        for number in range(100, 200):
            copied = copied or feed.wants_copy(number, 100)
            await asyncio.sleep(0.001)
        assert copied
        assert feed.repeats(2) == 2


async def test_under_a_ceiling_of_the_user_pictures_make_room_for_the_copies_of_much_loss() -> None:
    async with with_feed() as (feed, _):
        feed.begin([("rung", RUNG)], (400_000, 400_000), 0.0, 400_000)
        assert feed.budget_bps == 400_000
        for _lost in range(10):
            feed.heard(seen(lost=1))
        assert feed.budget_bps == 200_000


async def test_under_a_ceiling_of_the_user_little_loss_is_no_reason_for_copies() -> None:
    async with with_feed() as (feed, _):
        feed.begin([("rung", RUNG)], (400_000, 400_000), 0.0, 400_000)
        for number in range(12):
            feed.heard(seen(lost=number % 3 == 0))
        for number in range(50):
            assert not feed.wants_copy(number, 100)
            await asyncio.sleep(0.001)
        assert feed.budget_bps == 400_000


async def test_who_looks_away_is_sent_nothing_again() -> None:
    async with with_feed() as (feed, _):
        feed.heard(seen())
        congested(feed)
        feed.pause()
        assert feed.repeats(1) == 0
        assert not feed.wants_copy(1, 1000)
        feed.heard(seen())
        assert feed.budget_bps == 0


async def test_what_leads_is_served_first_and_the_rest_by_the_size_that_it_is_shown_at() -> None:
    connection, feeds = PeerCongestion(), []
    for _ in range(3):
        async with with_feed() as (feed, _wishes):
            feed.send_over(connection)
            feeds.append(feed)
    for feed in feeds:
        feed.begin([("rung", RUNG)], (100_000, 600_000), 0.0)
    front, large, small = feeds
    assert {feed.budget_bps for feed in feeds} == {200_000}
    large.shown(4 * USUAL_PX, leads=False)
    small.shown(USUAL_PX, leads=False)
    front.shown(USUAL_PX, leads=True)
    assert [feed.budget_bps for feed in feeds] == [400_000, 100_000, 100_000]
    front.shown(None, leads=False)
    assert [feed.budget_bps for feed in feeds] == [150_000, 300_000, 150_000]
    small.pause()
    small.shown(0, leads=True)
    assert small.budget_bps == 0
    for feed in feeds:
        feed.pause()
