"""A camera that shows nothing says why, and a picture takes that back."""

from __future__ import annotations

import asyncio
from typing import Any

from mosaic_core.machines.media.first_frame import ReceivedSoFar
from mosaic_core.operator.peers.media_bindings import FirstFrameWatch
from mosaic_core.operator.stores.media_store import MediaStreamStore
from mosaic_core.operator.stores.robot_connector import RobotConnector
from mosaic_core.words.data_type import MosaicDataType
from mosaic_core.words.errors import ConnectionFailed


class Video:
    def __init__(self, received: ReceivedSoFar | None) -> None:
        self._received = received

    async def received(self) -> ReceivedSoFar | None:
        return self._received

    def __getattr__(self, name: str) -> Any:
        raise AssertionError(name)


def opened_store() -> MediaStreamStore:
    store = MediaStreamStore(RobotConnector("r", "front", MosaicDataType.MEDIA))
    store.opened()
    return store


async def until_failed(store: MediaStreamStore) -> None:
    failed = asyncio.Event()
    store.when("after_connection_failed", failed.set)
    async with asyncio.timeout(30):
        await failed.wait()


async def test_the_store_tells_the_cause_until_a_picture_comes() -> None:
    store, watch = opened_store(), FirstFrameWatch(0.01)
    watch.began("front", store, Video(ReceivedSoFar(0, 0, 120)))
    await until_failed(store)
    assert store.state.code == "media.no_packets"
    watch.arrived("front")
    assert (store.state.phase, store.state.code) == ("open", "")
    watch.close()


async def test_a_picture_in_time_or_nobody_who_looks_leaves_the_store_alone() -> None:
    seen, left, late = opened_store(), opened_store(), opened_store()
    watch = FirstFrameWatch(0.01)
    watch.began("seen", seen, Video(ReceivedSoFar(0, 0, 0)))
    watch.began("left", left, Video(ReceivedSoFar(0, 0, 0)))
    watch.began("late", late, Video(ReceivedSoFar(0, 0, 0)))
    watch.arrived("seen")
    watch.ended("left")
    await until_failed(late)
    assert late.state.code == "media.not_sent"
    assert [one.state.code for one in (seen, left)] == ["", ""]
    watch.close()


async def test_what_the_robot_said_is_the_cause_until_a_picture_comes_after_all() -> None:
    store, watch = opened_store(), FirstFrameWatch()
    watch.began("front", store, Video(ReceivedSoFar(0, 0, 0)))
    watch.refused("front", store, ConnectionFailed("no line", code="media.no_line"))
    assert (store.state.phase, store.state.code) == ("closed", "media.no_line")
    watch.arrived("front")
    assert (store.state.phase, store.state.code) == ("open", "")
    watch.close()
