"""A camera that the server had not heard of when a program connected is watched on the live connection."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from mosaic_core import MediaTrackConfigurer, MediaTrackHandler, NoParams
from mosaic_core.operator.peers import further_offers as more_lines
from mosaic_core.testing import Joined, connector, joined
from mosaic_core.words.catalogue import Catalogue
from mosaic_core.words.errors import ConnectionFailed

TIMEOUT_S = 20.0
SHADES = {"front": 10, "rear": 20, "gripper": 30}


class LabelCamera(MediaTrackHandler):
    def frames(self) -> Iterator[Any]:
        for _ in self.every(0.02):
            yield np.full((4, 6), SHADES[self.label], np.uint8)


class LabelCameraConfigurer(MediaTrackConfigurer[NoParams]):
    connector_type = "camera"

    def configure(self) -> LabelCamera:
        return LabelCamera(self.label)


CAMERAS = tuple(connector(LabelCameraConfigurer, label=label) for label in ("front", "rear", "gripper"))


def shade_of(frame: Any) -> int:
    return int(frame.image[0, 0])


async def connected_knowing_only(link: Joined, *labels: str) -> Any:
    """Another connection, as if the server's catalogue were an older one."""
    robot_id = link.connection.robot_id
    full = link.operator.catalogues[robot_id]
    link.operator.catalogues[robot_id] = Catalogue.of(entry for entry in full.entries if entry.label in labels)
    return await link.operator.connect(robot_id)


async def test_its_pictures_come_and_those_of_the_first_one_go_on() -> None:
    async with joined(*CAMERAS) as link:
        connection = await connected_knowing_only(link, "front")
        front = connection.media("front")
        assert shade_of(await front.next_frame()) == SHADES["front"]
        rear, gripper = connection.media("rear"), connection.media("gripper")
        await rear.wait_open()
        assert shade_of(await rear.next_frame()) == SHADES["rear"]
        assert shade_of(await gripper.next_frame()) == SHADES["gripper"]
        assert shade_of(await front.next_frame()) == SHADES["front"]


async def test_the_first_line_of_all_may_come_later() -> None:
    async with joined(*CAMERAS) as link:
        connection = await connected_knowing_only(link)
        assert shade_of(await connection.media("rear").next_frame()) == SHADES["rear"]


async def test_a_robot_that_says_nothing_leaves_the_store_without_a_line(monkeypatch: pytest.MonkeyPatch) -> None:
    async def never(*_: Any) -> None:
        await asyncio.Event().wait()

    monkeypatch.setattr(more_lines, "ANSWER_TIMEOUT_S", 0.1)
    monkeypatch.setattr("mosaic_core.runtime.peers.further_offers.FurtherOffers.take", never)

    async with joined(*CAMERAS) as link:
        connection = await connected_knowing_only(link, "front")
        failed: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        rear = connection.media("rear")
        rear.when("after_connection_failed", lambda: failed.done() or failed.set_result(None))
        await failed
        assert rear.state.code == "media.no_line"
        assert connection.media("gripper").state.code == "media.no_line"
        assert connection.state == "connected"


async def test_a_refused_offer_does_too(monkeypatch: pytest.MonkeyPatch) -> None:
    async def refused(*_: Any) -> str:
        raise ConnectionFailed("no", code="sdp.no_common_codec")

    async with joined(*CAMERAS) as link:
        connection = await connected_knowing_only(link, "front")
        monkeypatch.setattr("mosaic_core.laboratory.memory_network.MemoryAnswerer.answer", refused)
        rear = connection.media("rear")
        with pytest.raises(ConnectionFailed):
            await rear.wait_open(1.0)
        assert rear.state.code == "media.no_line"
