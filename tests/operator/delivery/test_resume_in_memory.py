"""Reliable messages across a lost connection, with a real robot and a real operator in one process's memory."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest

from mosaic_core.contract.configurer import DataChannelConfigurer
from mosaic_core.contract.handler import DataChannelBidirectional, DataChannelReceivable, DataChannelSendable
from mosaic_core.contract.host import Sender
from mosaic_core.contract.params import Params
from mosaic_core.laboratory.joining import Joined, connector, joined, until
from mosaic_core.machines.delivery.resume import ResumeLimits
from mosaic_core.operator.stores.mosaic_store import Gap
from mosaic_core.runtime.delivery import resumed_stream, sessions


class Events(DataChannelSendable[dict[str, int]]):
    def __init__(self, label: str) -> None:
        super().__init__(label)


class EventsConfigurer(DataChannelConfigurer[Params]):
    def configure(self) -> Events:
        return Events(self.label)


class Notes(DataChannelReceivable[dict[str, int]]):
    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.heard: list[int] = []

    def handle_data(self, data: dict[str, int]) -> None:
        self.heard.append(data["n"])


class NotesConfigurer(DataChannelConfigurer[Params]):
    def configure(self) -> Notes:
        return Notes(self.label)


class Moves(DataChannelReceivable[dict[str, int]]):
    requires_lease = True

    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.heard: list[int] = []

    def handle_data(self, data: dict[str, int]) -> None:
        self.heard.append(data["n"])


class MovesConfigurer(DataChannelConfigurer[Params]):
    def configure(self) -> Moves:
        return Moves(self.label)


class Questions(DataChannelBidirectional[dict[str, int]]):
    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.askers: list[Sender] = []

    def handle_data(self, data: dict[str, int], sender: Sender) -> None:
        self.askers.append(sender)


class QuestionsConfigurer(DataChannelConfigurer[Params]):
    def configure(self) -> Questions:
        return Questions(self.label)


MORE_THAN_IS_KEPT = 6000
CONNECTORS = (
    connector(EventsConfigurer, label="events"),
    connector(NotesConfigurer, label="notes"),
    connector(MovesConfigurer, label="moves"),
    connector(QuestionsConfigurer, label="questions"),
)


def handler(link: Joined, label: str) -> Any:
    return next(one.handlers[0] for one in link.configured.connectors if one.config.label == label)


def counters(link: Joined, label: str) -> Any:
    return next(one for one in link.robot.snapshot().connectors if one.label == label)


class Heard:
    """What a subscriber got."""

    def __init__(self, link: Joined, label: str) -> None:
        self.store = link.connection.receivable(label)
        self.numbers: list[int] = []
        self.gaps: list[Gap] = []
        self.store.subscribe(lambda data: self.numbers.append(json.loads(data)["n"]))
        self.store.on_gap(self.gaps.append)


async def listening(link: Joined) -> tuple[Heard, Any]:
    """Somebody who has got the first event, number 0; and the handler that sends them."""
    heard, events = Heard(link, "events"), handler(link, "events")
    await heard.store.wait_open()
    await until(lambda: events.send_json({"n": 0}))
    await until(lambda: heard.numbers == [0])
    return heard, events


@asynccontextmanager
async def play() -> AsyncIterator[Any]:
    async with asyncio.timeout(20), joined(*CONNECTORS, takes_leases=False) as link:
        link.connection = await link.operator.connect(link.connection.robot_id, reconnect=True)
        await link.connection.control.take()
        yield link


async def test_events_of_a_robot_arrive_once_and_in_order_across_a_lost_connection() -> None:
    async with play() as link:
        heard, events = await listening(link)
        link.cut()
        for number in range(1, 40):
            events.send_json({"n": number})
        await until(lambda: counters(link, "events").messages == 40)
        link.network.lose()
        assert heard.store.state.phase == "reconnecting"
        assert heard.store.latest_age_s is not None
        await until(lambda: len(heard.numbers) >= 40)
        events.send_json({"n": 40})
        await until(lambda: heard.numbers[-1] == 40)
        assert heard.numbers == list(range(41))
        assert heard.gaps == []
        assert counters(link, "events").resent > 0
        assert counters(link, "events").lost == 0


async def test_what_an_operator_sends_meanwhile_arrives_afterwards_once_and_in_order() -> None:
    async with play() as link:
        store = link.connection.sendable("notes")
        await store.wait_open()
        notes = handler(link, "notes")
        assert store.send_json({"n": 0})
        await until(lambda: notes.heard == [0])
        link.cut()
        for number in range(1, 20):
            assert store.send_json({"n": number})
        link.network.lose()
        assert all(store.send_json({"n": number}) for number in range(20, 30))
        await until(lambda: len(notes.heard) >= 30)
        assert store.send_json({"n": 30})
        await until(lambda: notes.heard[-1] == 30)
        assert notes.heard == list(range(31))


async def test_a_message_that_arrived_but_was_not_confirmed_acts_once() -> None:
    async with play() as link:
        store = link.connection.sendable("notes")
        await store.wait_open()
        notes = handler(link, "notes")
        assert store.send_json({"n": 1})
        await until(lambda: notes.heard == [1])
        link.network.lose()
        await until(lambda: link.connection.state == "connected" and store.state.phase == "open")
        assert store.send_json({"n": 2})
        await until(lambda: notes.heard[-1] == 2)
        assert notes.heard == [1, 2]


async def test_what_moves_something_is_refused_while_there_is_no_connection_and_never_repeated() -> None:
    async with play() as link:
        store = link.connection.sendable("moves")
        await store.wait_open()
        moves = handler(link, "moves")
        assert store.send_json({"n": 1})
        await until(lambda: moves.heard == [1])
        link.cut()
        assert store.send_json({"n": 2})
        link.network.lose()
        assert not store.send_json({"n": 3})
        await until(lambda: store.state.phase == "open")
        await until(lambda: store.send_json({"n": 4}) and 4 in moves.heard)
        assert set(moves.heard) == {1, 4}


async def test_of_what_was_accepted_nothing_is_lost_however_much_it_was() -> None:
    async with play() as link:
        heard, events = await listening(link)
        link.cut()
        for number in range(1, MORE_THAN_IS_KEPT):
            events.send_json({"n": number})
            await asyncio.sleep(0)
        assert counters(link, "events").dropped > 0, "a sender is refused before anything is forgotten"
        link.network.lose()
        await until(lambda: len(heard.numbers) + counters(link, "events").dropped == MORE_THAN_IS_KEPT)
        await until(lambda: events.send_json({"n": MORE_THAN_IS_KEPT}), timeout_s=5)
        await until(lambda: heard.numbers[-1] == MORE_THAN_IS_KEPT)
        assert heard.numbers == sorted(set(heard.numbers))
        assert heard.gaps == []
        assert counters(link, "events").lost == 0


async def test_who_got_too_far_ahead_of_a_slow_confirmation_sends_again_after_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    few = ResumeLimits(messages=5, in_flight_messages=5)
    monkeypatch.setattr(sessions, "ResumeLimits", lambda messages, size_bytes, age_s: few)
    monkeypatch.setattr(resumed_stream, "TELL_AFTER", 1_000_000)

    async with play() as link:
        heard = Heard(link, "events")
        await heard.store.wait_open()
        events, number = handler(link, "events"), 0
        async with asyncio.timeout(15):
            while len(heard.numbers) < 25:
                number += 1
                events.send_json({"n": number})
                await asyncio.sleep(0.001)
        assert counters(link, "events").dropped > 0
        assert heard.numbers == sorted(set(heard.numbers))
        assert heard.gaps == []


async def test_what_was_kept_too_long_is_lost_and_told_on_both_sides(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sessions, "ResumeLimits", lambda messages, size_bytes, age_s: ResumeLimits(age_s=0.0))

    async with play() as link:
        heard, events = await listening(link)
        link.cut()
        for number in range(1, 10):
            events.send_json({"n": number})
        await until(lambda: counters(link, "events").messages == 10)
        link.network.lose()
        await until(lambda: link.connection.state == "connected" and heard.store.state.phase == "open")
        await until(lambda: events.send_json({"n": 10}))
        await until(lambda: heard.numbers[-1] == 10)
        assert heard.numbers == [0, 10]
        assert [gap.lost for gap in heard.gaps] == [9]
        assert counters(link, "events").lost == 9


async def test_an_answer_to_somebody_who_came_back_meanwhile_reaches_them() -> None:
    async with play() as link:
        store = link.connection.bidirectional("questions")
        answers: list[Any] = []
        store.subscribe(lambda data: answers.append(json.loads(data)))
        await store.wait_open()
        questions = handler(link, "questions")
        assert store.send_json({"n": 1})
        await until(lambda: questions.askers)
        link.network.lose()
        await until(lambda: link.connection.state == "connected" and store.state.phase == "open")
        assert questions.send_json({"n": 2}, to=questions.askers[0])
        await until(lambda: answers == [{"n": 2}])


async def test_a_good_bye_ends_the_session_and_a_new_one_begins_with_the_latched_value() -> None:
    async with play() as link:
        heard = Heard(link, "events")
        await heard.store.wait_open()
        events = handler(link, "events")
        for number in range(3):
            await until(lambda number=number: events.send_json({"n": number}))
        await until(lambda: len(heard.numbers) == 3)
        await link.connection.close()
        assert not events.send_json({"n": 3})
        connection = await link.operator.connect(link.connection.robot_id)
        again = connection.receivable("events")
        await again.wait_open()
        await until(lambda: again.latest is not None and again.latest.json() == {"n": 3})
        assert heard.gaps == []


async def test_whoever_says_good_bye_has_lost_nothing_of_what_arrived() -> None:
    async with play() as link:
        heard, _ = await listening(link)
        store = link.connection.bidirectional("questions")
        gaps: list[Gap] = []
        store.on_gap(gaps.append)
        await store.wait_open()
        assert store.send_json({"n": 1})
        await until(lambda: handler(link, "questions").askers)
        await link.connection.close()
        await until(lambda: not link.robot.snapshot().peers)
        assert (heard.gaps, gaps) == ([], [])
        assert counters(link, "events").lost == 0


async def test_a_store_that_is_made_anew_on_the_same_connection_misses_nothing_of_before() -> None:
    async with play() as link:
        heard, events = await listening(link)
        link.operator.stores.release_store(heard.store.robot_connector)
        await until(lambda: heard.store.state.phase == "closed")
        for number in range(1, 5):
            events.send_json({"n": number})
        again = Heard(link, "events")
        await again.store.wait_open()
        await until(lambda: events.send_json({"n": 9}) and again.numbers[-1:] == [9])
        assert again.gaps == []
        assert again.numbers[0] in (4, 9)
