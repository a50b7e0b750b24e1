"""The second peer connection for bulk data, robot and operator in one process."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from typing import Any

import pytest

from mosaic_core import DataChannelBidirectional, DataChannelConfigurer, DataChannelSendable, Message, NoParams
from mosaic_core.machines.peers import bulk_of_operator, bulk_of_robot
from mosaic_core.operator import ReceivableStore
from mosaic_core.testing import Joined, connector, joined, until

TIMEOUT_S = 20.0


class Piece(Message):
    number: int


class Map(DataChannelSendable[Piece]):
    def messages(self) -> Iterator[Piece]:
        for number in self.every(0.02):
            yield Piece(number=number)


class MapConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "map"

    def configure(self) -> Map:
        return Map(self.label)


class Files(DataChannelBidirectional[dict[str, Any]]):
    def handle_data(self, data: dict[str, Any]) -> None:
        self.send_json(data)


class FilesConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "files"

    def configure(self) -> Files:
        return Files(self.label)


def channels(link: Joined, number: int) -> list[str]:
    """The labels that the operator opened on its peer connection of this number."""
    return [channel.label for channel in list(link.network.links.values())[number]._channels if channel.is_open]


@pytest.fixture
def quick_retry(monkeypatch: pytest.MonkeyPatch) -> None:
    policy = bulk_of_operator.BackoffPolicy(first_s=0.1, factor=1.0, max_s=0.1, jitter=0.0)
    monkeypatch.setattr(bulk_of_operator, "RETRY", policy)
    monkeypatch.setattr(bulk_of_robot, "MAX_OFFERS_HZ", 100.0)


async def first_of(store: ReceivableStore) -> Any:
    await store.wait_open()
    return (await store.next_message()).json()


async def test_the_first_bulk_store_makes_the_bulk_connection_and_everything_else_stays_on_the_main_connection() -> (
    None
):
    entries = connector(MapConfigurer, label="map", delivery="bulk"), connector(MapConfigurer, label="pose")
    async with joined(*entries) as link:
        assert link.connection.bulk_lane == "none"
        await first_of(link.connection.receivable("pose"))
        assert link.connection.bulk_lane == "none"
        assert len(link.network.links) == 1
        assert (await first_of(link.connection.receivable("map")))["number"] >= 0
        assert link.connection.bulk_lane == "up"
        assert channels(link, 0) == ["_mosaic", "_stop", "pose"]
        assert channels(link, 1) == ["_lane", "map"]


async def test_bulk_goes_both_ways_over_the_bulk_connection() -> None:
    async with joined(connector(FilesConfigurer, label="files", delivery="bulk")) as link:
        store = link.connection.bidirectional("files")
        await store.wait_open()
        answer = asyncio.create_task(store.next_message())
        await asyncio.sleep(0)
        assert store.send_json({"name": "map.png"})
        assert (await answer).json() == {"name": "map.png"}
        assert channels(link, 1) == ["_lane", "files"]


async def test_a_bulk_connection_that_breaks_puts_bulk_on_the_main_connection_and_comes_back_for_the_next_store(
    quick_retry: None,
) -> None:
    entries = (
        connector(MapConfigurer, label="map", delivery="bulk"),
        connector(MapConfigurer, label="cloud", delivery="bulk"),
    )
    async with joined(*entries) as link:
        store = link.connection.receivable("map")
        await first_of(store)
        await list(link.network.links.values())[1].close()
        assert link.connection.bulk_lane == "failed"
        await first_of(store)
        assert "map" in channels(link, 0)
        await until(lambda: link.connection.bulk_lane == "up")
        await first_of(link.connection.receivable("cloud"))
        assert channels(link, 2) == ["_lane", "cloud"]


async def test_an_operator_who_wants_no_bulk_connection_makes_none() -> None:
    async with joined(connector(MapConfigurer, label="map", delivery="bulk")) as link:
        link.operator.uses_bulk_lane = False
        connection = await link.operator.connect(link.connection.robot_id)
        await first_of(connection.receivable("map"))
        assert connection.bulk_lane == "none"
        assert "map" in channels(link, 1)


async def test_the_bulk_connection_ends_with_its_main_connection() -> None:
    async with joined(connector(MapConfigurer, label="map", delivery="bulk")) as link:
        await first_of(link.connection.receivable("map"))
        await link.connection.close()
        await until(lambda: not link.robot.peers)
        assert all(channels(link, number) == [] for number in range(2))
