"""Requests from an operator to a connector and back, with a real robot in one process's memory."""

from __future__ import annotations

import asyncio
import json
import math
import threading
from collections.abc import Iterator
from typing import Any, ClassVar

import pytest

from mosaic_core import (
    DataChannelBidirectional,
    DataChannelConfigurer,
    DataChannelSendable,
    DeviceGone,
    Keeper,
    Message,
    NoParams,
    Refused,
    Request,
    RequestHandler,
)
from mosaic_core.laboratory.joining import Joined, connector, joined, until
from mosaic_core.operator import RequestFailed, RequestRefused
from mosaic_core.runtime.handlers.request_bodies import MAX_KINDS
from mosaic_core.words.errors import ConfigError, ConnectionFailed, MosaicError


class Sum(Message):
    numbers: list[float]


class Total(Message):
    total: float


class Adder(RequestHandler[Sum, Total]):
    def answer(self, question: Sum, request: Request) -> Total:
        if not question.numbers:
            raise Refused("adder.nothing", "there is nothing to add")
        if question.numbers[0] == 666:
            raise ValueError("the password is 1234")
        return Total(total=sum(question.numbers))


class AdderConfigurer(DataChannelConfigurer[NoParams]):
    def configure(self) -> Adder:
        return Adder(self.label)


class Walk(RequestHandler[dict[str, Any], dict[str, Any]]):
    """Goes on until it is let go, or cancelled."""

    requires_lease = True
    at_once: ClassVar[int] = 2

    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.began: list[str] = []
        self.cancelled: list[str] = []
        self.let_go = threading.Event()

    def answer(self, question: dict[str, Any], request: Request) -> dict[str, Any]:
        self.began.append(question["to"])
        request.progress({"to": question["to"]})
        while not self.let_go.is_set():
            if request.pause(0.005):
                self.cancelled.append(question["to"])
                break
        return {"at": question["to"]}


class WalkConfigurer(DataChannelConfigurer[NoParams]):
    def configure(self) -> Walk:
        return Walk(self.label)


class Slow(RequestHandler[dict[str, Any], int]):
    """The same on the event loop; and it may be looked at by anybody."""

    takes_observers: ClassVar[bool] = True
    answer_within_s: ClassVar[float] = 0.3

    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.cancelled = 0
        self.let_go = asyncio.Event()

    async def answer(self, question: dict[str, Any], request: Request) -> int:
        try:
            await self.let_go.wait()
        except asyncio.CancelledError:
            self.cancelled += 1
            raise
        return int(question["n"])


class Patient(Slow):
    answer_within_s: ClassVar[float] = 30.0


class SlowConfigurer(DataChannelConfigurer[NoParams]):
    def configure(self) -> Slow:
        return Slow(self.label)


class PatientConfigurer(DataChannelConfigurer[NoParams]):
    def configure(self) -> Slow:
        return Patient(self.label)


CONNECTORS = (
    connector(AdderConfigurer, label="adder"),
    connector(WalkConfigurer, label="walk"),
    connector(SlowConfigurer, label="slow"),
    connector(PatientConfigurer, label="patient"),
)


def handler(link: Joined, label: str) -> Any:
    return next(one.handlers[0] for one in link.configured.connectors if one.config.label == label)


async def test_a_question_is_answered_to_whoever_asked_alone() -> None:
    async with joined(*CONNECTORS) as link:
        bob = await link.another_operator()
        heard: list[bytes] = []
        store = bob.bidirectional("adder")
        store.subscribe(heard.append)
        await store.wait_open()
        assert await link.connection.request("adder", Sum(numbers=[1, 2])) == {"total": 3.0}
        assert await bob.request("adder", {"numbers": [5]}) == {"total": 5.0}
        assert [json.loads(one)["answer"] for one in heard] == [{"total": 5.0}]


async def test_a_misspelt_key_beside_the_question_is_refused_with_the_nearest() -> None:
    async with joined(*CONNECTORS) as link:
        with pytest.raises(RequestRefused, match=r"^no field 'number': did you mean 'numbers'\?$") as refused:
            await link.connection.request("adder", {"numbers": [1], "number": 3})
        assert refused.value.code == "channel.invalid"


class Forgetful(Adder):
    """Answers what is no total: nothing, or a misspelt one."""

    def answer(self, question: Sum, request: Request) -> Total:
        return {"totl": 1.0} if question.numbers else None  # type: ignore[return-value]


class ForgetfulConfigurer(DataChannelConfigurer[NoParams]):
    def configure(self) -> Forgetful:
        return Forgetful(self.label)


async def test_an_answer_that_the_class_does_not_declare_is_told_with_class_and_line(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async with joined(connector(ForgetfulConfigurer, label="adder")) as link:
        for numbers in ([], [1], [1], []):
            with pytest.raises(RequestRefused) as refused:
                await link.connection.request("adder", {"numbers": numbers})
            assert refused.value.code == "request.failed"
    absent, misspelt = (one for one in caplog.records if "could not answer" in one.message)  # each mistake once
    place = f"Forgetful.answer ({__file__}:{Forgetful.answer.__code__.co_firstlineno}) declares Total"
    assert place in absent.message
    assert f"{place} and answers dict (total: Field required; no field 'totl'" in misspelt.message
    assert absent.exc_info is None  # all of it would be the framework's own lines


class Unplugged(Adder):
    def answer(self, question: Sum, request: Request) -> Total:
        raise DeviceGone("no scale at /dev/ttyUSB0", "plug it in")


class UnpluggedConfigurer(DataChannelConfigurer[NoParams]):
    def configure(self) -> Unplugged:
        return Unplugged(self.label)


async def test_an_absent_device_is_told_as_one_quietly(caplog: pytest.LogCaptureFixture) -> None:
    async with joined(connector(UnpluggedConfigurer, label="adder")) as link:
        for _ in range(2):
            with pytest.raises(RequestRefused) as refused:
                await link.connection.request("adder", {"numbers": [1]})
            assert refused.value.code == "plugin.no_device"
            assert "ttyUSB0" not in refused.value.message
    (told,) = (one for one in caplog.records if "could not answer" in one.message)
    assert told.message.endswith("no scale at /dev/ttyUSB0; plug it in (plugin.no_device)")
    assert (told.levelname, told.exc_info) == ("WARNING", None)


class Kept(Unplugged):
    def __init__(self, label: str) -> None:
        super().__init__(label)
        self.keeper = Keeper("scale", lambda: None)


class KeptConfigurer(DataChannelConfigurer[NoParams]):
    def configure(self) -> Kept:
        kept = Kept(self.label)
        assert kept.keeper is not None
        kept.keeper.start()
        return kept


async def test_whoever_finds_a_kept_device_gone_while_he_answers_tells_its_keeper() -> None:
    async with joined(connector(KeptConfigurer, label="adder")) as link:
        keeper = handler(link, "adder").keeper
        heard: list[str] = []

        class Listener:
            def away(self, gone: DeviceGone, tries_again_in_s: float) -> None:
                heard.append(gone.message)

            def is_back(self) -> None:
                heard.append("back")

        keeper.listen(Listener())
        try:
            with pytest.raises(RequestRefused):
                await link.connection.request("adder", {"numbers": [1]})
            await until(lambda: heard[-1:] == ["back"])
            assert heard[0].startswith("no scale at /dev/ttyUSB0")
        finally:
            keeper.stop()


class Random(Adder):
    def answer(self, question: Sum, request: Request) -> Total:
        return {"total": 1.0, f"key{question.numbers[0]:.0f}": 1.0}  # type: ignore[return-value]


class RandomConfigurer(DataChannelConfigurer[NoParams]):
    def configure(self) -> Random:
        return Random(self.label)


async def test_wrong_answers_without_number_are_a_bounded_number_of_lines(caplog: pytest.LogCaptureFixture) -> None:
    async with joined(connector(RandomConfigurer, label="adder")) as link:
        for number in range(MAX_KINDS + 10):
            with pytest.raises(RequestRefused):
                await link.connection.request("adder", {"numbers": [number]})
    assert sum("could not answer" in one.message for one in caplog.records) == MAX_KINDS + 1


async def test_a_question_alone_is_answered_without_a_number() -> None:
    async with joined(*CONNECTORS) as link:
        store = link.connection.bidirectional("adder")
        await store.wait_open()
        store.send_json({"numbers": [1]})
        assert (await store.next_message()).json() == {"answer": {"total": 1.0}}
        store.send_json({"numbers": "none"})
        assert (await store.next_message()).json()["refused"]["code"] == "channel.invalid"
        store.send_json({"id": 7, "question": {"numbers": []}})
        assert (await store.next_message()).json()["refused"]["code"] == "request.bad_id"
        store.send_json({"id": "7", "question": {"numbers": []}})
        refused = {"code": "adder.nothing", "message": "there is nothing to add"}
        assert (await store.next_message()).json() == {"id": "7", "refused": refused}


async def test_an_error_of_the_handler_is_for_the_robots_log(caplog: pytest.LogCaptureFixture) -> None:
    async with joined(*CONNECTORS) as link:
        with pytest.raises(RequestRefused) as refused:
            await link.connection.request("adder", {"numbers": [666]})
        assert refused.value.code == "request.failed"
        assert "password" not in refused.value.message
        assert any("test_requests_in_memory.py:" in record.getMessage() for record in caplog.records)
        assert await link.connection.request("adder", {"numbers": [4]}) == {"total": 4.0}


async def test_so_many_are_answered_at_once_and_the_others_wait() -> None:
    async with joined(*CONNECTORS, takes_leases=True) as link:
        walk = handler(link, "walk")
        told: list[Any] = []
        asked = [
            asyncio.create_task(link.connection.request("walk", {"to": place}, on_progress=told.append))
            for place in ("a", "b", "c")
        ]
        await until(lambda: len(told) == 2)
        assert sorted(walk.began) == ["a", "b"]
        walk.let_go.set()
        assert [one["at"] for one in await asyncio.gather(*asked)] == ["a", "b", "c"]


async def test_who_waits_no_longer_takes_the_request_back() -> None:
    async with joined(*CONNECTORS, takes_leases=True) as link:
        walk = handler(link, "walk")
        asked = asyncio.create_task(link.connection.request("walk", {"to": "a"}))
        await until(lambda: walk.began)
        asked.cancel()
        await until(lambda: walk.cancelled == ["a"])


class Sums(DataChannelSendable[Total]):
    def messages(self) -> Iterator[Total]:
        yield Total(total=0.0)


class SumsConfigurer(DataChannelConfigurer[NoParams]):
    def configure(self) -> Sums:
        return Sums(self.label)


class Abacus(DataChannelBidirectional[Total]):
    def handle_data(self, data: Total) -> None:
        """It keeps what it hears to itself."""


class AbacusConfigurer(DataChannelConfigurer[NoParams]):
    def configure(self) -> Abacus:
        return Abacus(self.label)


@pytest.mark.parametrize("deaf", [SumsConfigurer, AbacusConfigurer])
async def test_what_answers_no_requests_is_told_with_the_nearest_label_that_does(
    deaf: type[DataChannelConfigurer[NoParams]],
) -> None:
    async with joined(*CONNECTORS, connector(deaf, label="added")) as link:
        with pytest.raises(ConnectionFailed) as told:
            await link.connection.request("added", {})
        assert told.value.message == "'added' answers no requests; did you mean 'adder'?"
        assert told.value.cure == "Those that do: adder, walk, slow, patient."


@pytest.mark.parametrize("end", ["refused", "cancelled", "timed out"])
async def test_a_request_without_an_answer_is_no_lost_message(caplog: pytest.LogCaptureFixture, end: str) -> None:
    async with joined(*CONNECTORS, takes_leases=True) as link:
        if end == "refused":
            with pytest.raises(RequestRefused):
                await link.connection.request("adder", {"numbers": []})
        elif end == "timed out":
            with pytest.raises(RequestFailed):
                await link.connection.request("patient", {"n": 1}, timeout_s=0.05)
        else:
            with pytest.raises(TimeoutError):
                await asyncio.wait_for(link.connection.request("patient", {"n": 1}), 0.05)
        await link.connection.close()
    assert not [one for one in caplog.records if "lost while there was no connection" in one.getMessage()]


async def test_a_stop_cancels_what_needs_a_lease_and_refuses_more() -> None:
    async with joined(*CONNECTORS, takes_leases=True) as link:
        walk = handler(link, "walk")
        asked = asyncio.create_task(link.connection.request("walk", {"to": "a"}))
        await until(lambda: walk.began)
        await link.connection.control.stop("a dog")
        with pytest.raises(RequestRefused) as refused:
            await asked
        assert refused.value.code == "safety.stop"
        await until(lambda: walk.cancelled == ["a"])
        with pytest.raises(RequestRefused) as refused:
            await link.connection.request("walk", {"to": "b"})
        assert refused.value.code == "safety.stopped"
        assert await link.connection.request("adder", {"numbers": [1]}) == {"total": 1.0}


async def test_the_lease_is_asked_for_and_its_loss_cancels() -> None:
    async with joined(*CONNECTORS, takes_leases=False) as link:
        walk = handler(link, "walk")
        with pytest.raises(RequestRefused) as refused:
            await link.connection.request("walk", {"to": "a"})
        assert refused.value.code == "lease.required"
        lease = await link.connection.control.take()
        asked = asyncio.create_task(link.connection.request("walk", {"to": "a"}))
        await until(lambda: walk.began)
        lease.release()
        with pytest.raises(RequestRefused) as refused:
            await asked
        assert refused.value.code == "safety.lease_lost"


async def test_observers_ask_only_what_is_for_them() -> None:
    async with joined(*CONNECTORS) as link:
        eve = await link.another_operator("Eve", role="observer")
        with pytest.raises(RequestRefused) as refused:
            await eve.request("adder", {"numbers": [1]})
        assert refused.value.code == "lease.forbidden"
        handler(link, "patient").let_go.set()
        assert await eve.request("patient", {"n": 1}) == 1


async def test_a_question_that_can_not_be_asked_is_told_with_its_field() -> None:
    async with joined(*CONNECTORS) as link:
        for question, field in (({"numbers": [1.0, math.nan]}, "numbers[]"), (Total(total=math.inf), "total")):
            with pytest.raises(MosaicError) as failed:
                await link.connection.request("adder", question)
            assert failed.value.code == "safety.not_finite"
            assert failed.value.message == f"the question holds what is no finite number: {field}"
        with pytest.raises(RequestRefused, match=r"^numbers: Field required; no field 'nubers': did you mean"):
            await link.connection.request("adder", {"nubers": [1]})


async def test_what_takes_too_long_is_refused_and_cancelled() -> None:
    async with joined(*CONNECTORS) as link:
        with pytest.raises(RequestRefused) as refused:
            await link.connection.request("slow", {"n": 1})
        assert refused.value.code == "request.timeout"
        await until(lambda: handler(link, "slow").cancelled == 1)
        with pytest.raises(RequestFailed) as failed:
            await link.connection.request("patient", {"n": 1}, timeout_s=0.2)
        assert failed.value.code == "request.timeout"
        await until(lambda: handler(link, "patient").cancelled == 1)


async def test_a_peer_that_leaves_takes_its_requests_along() -> None:
    async with joined(*CONNECTORS) as link:
        asked = asyncio.create_task(link.connection.request("patient", {"n": 1}))
        await until(lambda: link.connection._callers["patient"]._waiting if link.connection._callers else False)
        await link.connection.request("adder", {"numbers": [1]})
        await link.connection.close()
        with pytest.raises(RequestFailed) as failed:
            await asked
        assert failed.value.code == "request.lost"
        await until(lambda: handler(link, "patient").cancelled == 1)


async def test_an_answer_survives_a_lost_connection() -> None:
    async with asyncio.timeout(20), joined(*CONNECTORS, takes_leases=False) as link:
        connection = await link.operator.connect(link.connection.robot_id, reconnect=True)
        patient = handler(link, "patient")
        asked = asyncio.create_task(connection.request("patient", {"n": 5}))
        await connection.request("adder", {"numbers": [1]})
        link.cut()
        link.network.lose()
        assert connection.state == "reconnecting"
        patient.let_go.set()
        assert await asked == 5


async def test_what_moves_something_is_lost_with_its_connection() -> None:
    async with asyncio.timeout(20), joined(*CONNECTORS, takes_leases=False) as link:
        connection = await link.operator.connect(link.connection.robot_id, reconnect=True)
        await connection.control.take()
        walk = handler(link, "walk")
        asked = asyncio.create_task(connection.request("walk", {"to": "a"}))
        await until(lambda: walk.began)
        link.cut()
        link.network.lose()
        with pytest.raises(RequestFailed) as failed:
            await asked
        assert failed.value.code == "request.lost"
        await until(lambda: walk.cancelled == ["a"])


async def test_the_catalogue_tells_question_and_answer() -> None:
    async with joined(*CONNECTORS) as link:
        assert link.connection.catalogue is not None
        entry = next(one for one in link.connection.catalogue.entries if one.label == "adder")
        assert entry.widget == "request"
        assert entry.message_schema is not None
        assert entry.answer_schema is not None
        assert list(entry.message_schema["properties"]) == ["numbers"]
        assert list(entry.answer_schema["properties"]) == ["total"]


@pytest.mark.parametrize(
    ("more", "complaint"),
    [
        ({"safety": {"timeout_s": 1.0}}, "'timeout_s' has no meaning"),
        ({"safety": {"limits": {"n": {"max": 1.0}}}}, "'limits' has no meaning"),
        ({"delivery": "latest"}, "none may be lost"),
    ],
)
async def test_the_file_says_nothing_that_a_request_can_not_follow(more: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ConfigError, match=complaint):
        async with joined(connector(AdderConfigurer, label="adder", **more)):
            pass
