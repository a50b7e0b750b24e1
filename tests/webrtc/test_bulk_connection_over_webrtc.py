"""The second peer connection for bulk over real WebRTC: robot and operator in one process."""

from __future__ import annotations

import asyncio
import gc
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, ClassVar

import pytest

from mosaic_core import DataChannelBidirectional, DataChannelConfigurer, DataChannelSendable, NoParams
from mosaic_core.adapters.peers.aiortc_offerer import AiortcOfferer
from mosaic_core.contract.handler import Runs
from mosaic_core.laboratory.networks import WebRtcNetwork
from mosaic_core.testing import connector, joined, until

pytestmark = pytest.mark.webrtc
MAP = bytes(range(256)) * 4096
WAIT_S = 20.0


class Map(DataChannelSendable[bytes]):
    runs: ClassVar[Runs] = "watched"

    def messages(self) -> Iterator[bytes]:
        for _ in self.every(0.05):
            yield MAP


class MapConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "map"

    def configure(self) -> Map:
        return Map(self.label)


class Echo(DataChannelBidirectional[dict[str, Any]]):
    def handle_data(self, data: dict[str, Any]) -> None:
        self.send_json(data)


class EchoConfigurer(DataChannelConfigurer[NoParams]):
    connector_type = "echo"

    def configure(self) -> Echo:
        return Echo(self.label)


class DirectNetwork(WebRtcNetwork):
    """Without the path between, which keeps sockets of its own."""

    def __init__(self) -> None:
        super().__init__()
        self.offerer = AiortcOfferer


@asynccontextmanager
async def direct() -> AsyncIterator[Any]:
    entries = connector(MapConfigurer, label="map", delivery="bulk"), connector(EchoConfigurer, label="echo")
    with DirectNetwork() as network:
        async with asyncio.timeout(60), joined(*entries, network=network) as link:
            yield link


def sockets() -> int:
    folder = Path("/proc/self/fd")
    return sum(str(one.readlink()).startswith("socket:") for one in folder.iterdir() if one.is_symlink())


async def test_bulk_arrives_whole_over_the_bulk_connection_and_over_the_main_connection_when_it_is_gone() -> None:
    async with direct() as link:
        store = link.connection.receivable("map")
        await store.wait_open()
        assert link.connection.bulk_lane == "up"
        assert (await store.next_message(WAIT_S)).data == MAP
        bulk = next(iter(link.robot._running.peers))._bulk
        await bulk._attempt.end.close()
        await until(lambda: link.connection.bulk_lane == "failed")
        await store.wait_open()
        assert (await store.next_message(WAIT_S)).data == MAP
        echo = link.connection.bidirectional("echo")
        await echo.wait_open()
        answer = asyncio.create_task(echo.next_message(WAIT_S))
        await asyncio.sleep(0)
        echo.send_json({"n": 1})
        assert (await answer).json() == {"n": 1}


async def test_bulk_connections_that_come_and_go_leave_no_task_and_no_socket(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mosaic_core.machines.peers.bulk_of_robot.MAX_OFFERS_HZ", 1000.0)

    async with direct() as link:

        async def once() -> None:
            connection = await link.operator.connect(link.connection.robot_id)
            await connection.receivable("map").wait_open()
            assert connection.bulk_lane == "up"
            await connection.close()
            link.operator.stores.close()
            await until(lambda: not link.robot.peers)
            await link.robot._running.peers.closed()

        await once()
        gc.collect()
        tasks, open_sockets = len(asyncio.all_tasks()), sockets()
        for _ in range(8):
            await once()
        gc.collect()
        await until(lambda: len(asyncio.all_tasks()) <= tasks)
        await until(lambda: sockets() <= open_sockets)
