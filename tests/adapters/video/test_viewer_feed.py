"""One viewer whose receiver tells of every packet: pauses while a queue drains, repeats and copies what gets lost."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

import av

from mosaic_core.adapters.video.viewer_feed import ViewerFeed
from mosaic_core.machines.congestion.path_rate import PathRate
from mosaic_core.machines.congestion.path_watch import PathSeen
from mosaic_core.machines.congestion.rate_control import RateControl, ReceiverReport
from mosaic_core.machines.media.rung_ladder import Rung

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


def with_feed(check: Callable[[ViewerFeed, Wishes], Any]) -> None:
    async def run() -> None:
        wishes = Wishes()
        feed = ViewerFeed(("video/VP8",), lambda code: None, wishes.key, wishes.changed)
        feed.begin([("rung", RUNG)], (150_000, 2_000_000), 0.0)
        feed.switch.want("rung")
        feed.switch.takes("rung", True)
        await check(feed, wishes)
        feed.pause()

    asyncio.run(run())


def congested(feed: ViewerFeed) -> None:
    """A second of pictures, and the reports of a queue."""
    assert feed.rate is not None
    for _ in range(2):
        feed.heard(seen(queue_s=0.2, path_bps=300_000, empties_in_s=0.15))


def test_the_first_arrivals_change_how_its_rate_is_found() -> None:
    async def check(feed: ViewerFeed, wishes: Wishes) -> None:
        assert isinstance(feed.rate, RateControl)
        before_bps = feed.budget_bps
        feed.heard(seen())
        assert isinstance(feed.rate, PathRate)
        assert feed.budget_bps == before_bps
        feed.heard(ReceiverReport(0, 10, 0.07))
        assert feed.rate.round_trip_s == 0.07

    with_feed(check)


def test_while_a_queue_drains_nothing_is_sent_and_then_a_key_frame() -> None:
    async def check(feed: ViewerFeed, wishes: Wishes) -> None:
        feed.heard(seen())
        feed.put(packet())
        changes = wishes.changes
        congested(feed)
        assert feed.budget_bps == 240_000
        assert wishes.changes == changes + 1  # by the report before the cut
        assert not feed.switch.takes("rung", False)
        await asyncio.wait_for(wishes.asked.wait(), 5)
        assert wishes.changes == changes + 2
        assert feed.switch.takes("rung", True)

    with_feed(check)


def test_a_key_frame_ends_the_pause() -> None:
    async def check(feed: ViewerFeed, wishes: Wishes) -> None:
        feed.heard(seen())
        congested(feed)
        feed.put(packet(is_key=True))
        changes = wishes.changes
        feed.heard(ReceiverReport(0, 10))
        assert wishes.changes == changes + 1
        assert (await feed.next()).is_keyframe

    with_feed(check)


def test_on_a_lossy_path_packets_are_sent_twice_and_repeats_too() -> None:
    async def check(feed: ViewerFeed, wishes: Wishes) -> None:
        assert feed.repeats(1) == 1
        assert not any(feed.wants_copy(number, 1000) for number in range(10))
        for _ in range(10):
            feed.heard(seen(lost=1))
        copied = False
        for number in range(100, 200):
            copied = copied or feed.wants_copy(number, 100)
            await asyncio.sleep(0.001)
        assert copied
        assert feed.repeats(2) == 2

    with_feed(check)


def test_under_a_ceiling_of_the_user_pictures_make_room_for_the_copies_of_much_loss() -> None:
    async def check(feed: ViewerFeed, wishes: Wishes) -> None:
        feed.begin([("rung", RUNG)], (400_000, 400_000), 0.0, 400_000)
        assert feed.budget_bps == 400_000
        for _ in range(10):
            feed.heard(seen(lost=1))
        assert feed.budget_bps == 200_000

    with_feed(check)


def test_under_a_ceiling_of_the_user_little_loss_is_no_reason_for_copies() -> None:
    async def check(feed: ViewerFeed, wishes: Wishes) -> None:
        feed.begin([("rung", RUNG)], (400_000, 400_000), 0.0, 400_000)
        for number in range(12):
            feed.heard(seen(lost=number % 3 == 0))
        for number in range(50):
            assert not feed.wants_copy(number, 100)
            await asyncio.sleep(0.001)
        assert feed.budget_bps == 400_000

    with_feed(check)


def test_who_looks_away_is_sent_nothing_again() -> None:
    async def check(feed: ViewerFeed, wishes: Wishes) -> None:
        feed.heard(seen())
        congested(feed)
        feed.pause()
        assert feed.repeats(1) == 0
        assert not feed.wants_copy(1, 1000)
        feed.heard(seen())
        assert feed.budget_bps == 0

    with_feed(check)
