"""The robot's end of the second peer connection: what may travel there, and what becomes of it."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest

from mosaic_core import DataChannelJsonReceivable, DataChannelSendable
from mosaic_core.machines.peers import bulk_of_robot
from mosaic_core.words import control
from mosaic_core.words.data_type import Delivery

CANDIDATE = {"candidate": "candidate:5", "sdp_mid": "0"}


class Map(DataChannelSendable[dict[str, Any]]):
    def __init__(self, label: str = "map") -> None:
        super().__init__(label)


class Upload(DataChannelJsonReceivable):
    def __init__(self, label: str = "upload") -> None:
        super().__init__(label)
        self.got: list[Any] = []

    def handle_data(self, data: dict[str, Any]) -> None:
        self.got.append(data)


class Place:
    """A robot with bulk connectors and one that is not, and Ann beside it."""

    def __init__(self, kit: Any, scene: Any, ann: Any, map_: Map, upload: Upload) -> None:
        self.kit, self.scene, self.ann, self.map, self.upload = kit, scene, ann, map_, upload

    async def offers(self, attempt: int = 1, sdp: str = "offer") -> Any:
        """The robot's end of the bulk connection, answered."""
        before = len(self.scene.network.order)
        self.ann.say(control.LaneOffer(attempt=attempt, sdp=sdp))
        await self.ann.hears("lane.answer", attempt)
        return self.scene.network.order[before]

    async def sends(self, channel: Any, value: dict[str, Any]) -> None:
        """The map's value arrives on ``channel``."""
        assert self.map.send_json(value)
        await self.kit.until(lambda: value in channel.values())


@asynccontextmanager
async def played(kit: Any) -> AsyncIterator[Any]:
    map_, upload, pose = Map(), Upload(), Map("pose")
    bulk = (kit.connector_of(one, delivery=Delivery.BULK) for one in (map_, upload))
    async with kit.running(*bulk, kit.connector_of(pose)) as scene:
        yield Place(kit, scene, await scene.enters("ann"), map_, upload)


@pytest.fixture
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """A robot that takes offers as fast as a test makes them."""
    monkeypatch.setattr(bulk_of_robot, "MAX_OFFERS_HZ", 1000.0)


async def test_an_offer_is_answered_with_its_number_and_candidates_follow(kit: Any) -> None:
    async with played(kit) as place:
        bulk = await place.offers()
        assert place.ann.heard("lane.answer")[0] == control.LaneAnswer(attempt=1, sdp="answer")
        found = await place.ann.hears("lane.candidate")
        assert (found.attempt, found.sdp_mid) == (1, "0")
        assert found.candidate.startswith("candidate:")
        place.ann.say(control.LaneCandidate(attempt=1, **CANDIDATE))
        await kit.until(lambda: bulk.candidates)
        assert bulk.candidates[0].candidate == "candidate:5"


async def test_both_connections_share_one_budget(kit: Any) -> None:
    async with played(kit) as place:
        bulk = await place.offers()
        assert bulk.listener.congestion is next(iter(place.scene.robot._running.peers)).congestion


async def test_bulk_travels_on_the_bulk_connection_both_ways(kit: Any) -> None:
    async with played(kit) as place:
        bulk = await place.offers()
        bulk.listener.state_changed("connected")
        bulk.open("_lane")
        await place.sends(bulk.open("map"), {"cells": 1})
        bulk.open("upload").say({"part": 1})
        await kit.until(lambda: place.upload.got == [{"part": 1}])


async def test_the_bulk_connection_answers_pings(kit: Any) -> None:
    async with played(kit) as place:
        channel = (await place.offers()).open("_lane")
        channel.say({"type": "ping", "data": {"t0": 7}})
        await kit.until(lambda: channel.values())
        assert channel.values()[0]["type"] == "pong"
        assert channel.values()[0]["data"]["t0"] == 7


@pytest.mark.parametrize(
    ("label", "protocol", "code"),
    [
        ("pose", "mosaic.1", "channel.wrong_lane"),
        ("map", "", "channel.wrong_lane"),
        ("nothing", "mosaic.1", "channel.unknown_label"),
        ("_mosaic", "mosaic.1", "channel.unknown_label"),
        ("_stop", "mosaic.1", "channel.unknown_label"),
    ],
)
async def test_nothing_but_framed_bulk_travels_there(kit: Any, label: str, protocol: str, code: str) -> None:
    async with played(kit) as place:
        channel = (await place.offers()).open(label, protocol)
        await place.ann.hears("refusal")
        assert place.ann.codes() == [code]
        assert not channel.is_open
        assert channel.on_message is None


async def test_bulk_goes_over_the_main_connection_when_the_bulk_connection_is_gone(kit: Any) -> None:
    async with played(kit) as place:
        bulk = await place.offers()
        bulk.listener.state_changed("connected")
        await place.sends(bulk.open("map"), {"cells": 1})
        bulk.listener.state_changed("failed")
        assert (await place.ann.hears("lane.close")).code == "peer.lost"
        await kit.until(lambda: bulk.is_closed)
        await place.sends(place.ann.open("map"), {"cells": 2})
        assert place.scene.robot.peers


async def test_a_channel_opened_anew_on_the_other_connection_takes_the_place_of_the_old_one(kit: Any) -> None:
    async with played(kit) as place:
        main = place.ann.open("map")
        await place.sends(main, {"cells": 1})
        bulk = await place.offers()
        await place.sends(bulk.open("map"), {"cells": 2})
        assert {"cells": 2} not in main.values()
        bulk.listener.state_changed("failed")
        await kit.until(lambda: bulk.is_closed)


async def test_an_operator_who_closes_the_bulk_connection_hears_nothing_more_of_it(kit: Any) -> None:
    async with played(kit) as place:
        bulk = await place.offers()
        place.ann.say(control.LaneClose(attempt=1))
        await kit.until(lambda: bulk.is_closed)
        assert place.ann.heard("lane.close") == []


async def test_a_bad_offer_and_one_with_media_are_refused_with_a_code(kit: Any, patient: None) -> None:
    async with played(kit) as place:
        place.ann.say(control.LaneOffer(attempt=1, sdp="bad"))
        assert (await place.ann.hears("lane.close")).code == "sdp.no_common_codec"
        place.ann.say(control.LaneOffer(attempt=2, sdp="m=video 9 UDP/TLS/RTP/SAVPF 96"))
        assert (await place.ann.hears("lane.close", 2)).code == "sdp.invalid"


async def test_offers_in_quick_succession_are_refused(kit: Any) -> None:
    async with played(kit) as place:
        for attempt in range(1, 9):
            place.ann.say(control.LaneOffer(attempt=attempt, sdp="offer"))
        await place.ann.hears("lane.close", 6)
        assert {refused.code for refused in place.ann.heard("lane.close")} == {"lane.refused"}
        assert len(place.scene.network.order) <= 3
        await kit.until(lambda: all(end.is_closed for end in place.scene.network.order[1:]))


async def test_an_oversized_offer_never_reaches_the_transport(kit: Any) -> None:
    async with played(kit) as place:
        big = {"type": "lane.offer", "data": {"lane": "bulk", "attempt": 1, "sdp": "x" * 20_000}}
        place.ann.control.channel.say(big)
        await place.ann.hears("refusal")
        assert len(place.scene.network.order) == 1


async def test_the_bulk_connection_takes_the_youngest_ice_servers_of_the_robot(kit: Any) -> None:
    async with played(kit) as place:
        bulk = await place.offers()
        assert bulk.ice_servers == place.scene.robot._running.peers.newest_ice_servers()


async def test_the_bulk_connection_ends_with_its_main_connection(kit: Any) -> None:
    async with played(kit) as place:
        bulk = await place.offers()
        channel = bulk.open("map")
        await place.sends(channel, {"cells": 1})
        place.ann.leave()
        await kit.until(lambda: bulk.is_closed and not place.scene.robot.peers)
        late = bulk.open("map")
        assert late.on_message is None


async def test_a_bulk_connection_that_is_still_being_answered_ends_too(
    kit: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with played(kit) as place:
        go_on = asyncio.Event()
        peer = next(iter(place.scene.robot._running.peers))
        made = peer._bulk.make_answerer

        def slow(listener: Any) -> Any:
            answerer = made(listener)
            answer = answerer.answer

            async def answered(*arguments: Any) -> str:
                await go_on.wait()
                return str(await answer(*arguments))

            monkeypatch.setattr(answerer, "answer", answered)
            return answerer

        monkeypatch.setattr(peer._bulk, "make_answerer", slow)
        place.ann.say(control.LaneOffer(attempt=1, sdp="offer"))
        await kit.until(lambda: len(place.scene.network.order) == 2)
        place.ann.leave()
        go_on.set()
        await asyncio.wait_for(peer.closed(), 3)
        assert place.scene.network.order[1].is_closed
        assert place.ann.heard("lane.answer") == []


async def test_a_hundred_bulk_connections_leave_no_task_behind(kit: Any, patient: None) -> None:
    async with played(kit) as place:
        tasks = len(asyncio.all_tasks())
        for attempt in range(1, 101):
            bulk = await place.offers(attempt)
            bulk.listener.state_changed("connected")
            bulk.open("_lane")
            bulk.open("map")
            place.ann.say(control.LaneClose(attempt=attempt))
            await kit.until(lambda bulk=bulk: bulk.is_closed)
        await kit.until(lambda: len(asyncio.all_tasks()) <= tasks)
        peer = next(iter(place.scene.robot._running.peers))
        assert peer.channels == ()
        assert peer._bulk._attempt is None
