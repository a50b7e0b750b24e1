"""The kit asks a request handler as an operator does: progress, cancel, refusals, all on the fake clock."""

from __future__ import annotations

import asyncio
import socket
import time
from collections.abc import AsyncIterator

import pytest

from mosaic_core import (
    DataChannelConfigurer,
    DataChannelReceivable,
    DataChannelSendable,
    Message,
    NoParams,
    Refused,
    Request,
    RequestHandler,
)
from mosaic_core.testing import ANOTHER_OPERATOR, MadeSafe, RefusedMessage, ask, build, collect, fake_host, feed


class Weigh(Message):
    seconds: float


class Weight(Message):
    kilograms: float
    of: str


class Scale(RequestHandler[Weigh, Weight]):
    answer_within_s = 10.0

    def answer(self, question: Weigh, request: Request) -> Weight:
        if question.seconds < 0:
            raise Refused("scale.time", "time runs forward")
        for second in range(int(question.seconds)):
            request.progress({"second": second})
            if request.pause(1.0):
                break
        return Weight(kilograms=2.5, of=request.sender.name)


class AsyncScale(Scale):
    async def answer(self, question: Weigh, request: Request) -> Weight:  # type: ignore[override]
        request.progress(question)
        await asyncio.sleep(question.seconds)
        return Weight(kilograms=await asyncio.to_thread(lambda: 2.5), of=request.sender.name)


class ScaleConfigurer(DataChannelConfigurer[NoParams]):
    def configure(self) -> Scale:
        return Scale(self.label)


@pytest.fixture(params=[Scale, AsyncScale])
def scale(request: pytest.FixtureRequest) -> Scale:
    made: Scale = request.param("scale")
    return made


def test_the_answer_is_what_an_operator_gets(scale: Scale) -> None:
    answered = ask(scale, {"seconds": 3}, sender=ANOTHER_OPERATOR)
    assert answered.answer == {"kilograms": 2.5, "of": "Bob"}
    assert (answered.refused, answered.took_s) == (None, 3.0)


def test_progress_is_kept_as_json() -> None:
    assert ask(build(ScaleConfigurer), Weigh(seconds=2)).progress == [{"second": 0}, {"second": 1}]
    assert ask(AsyncScale("scale"), Weigh(seconds=2)).progress == [{"seconds": 2.0}]


def test_a_request_that_is_taken_back_ends_at_that_time(scale: Scale) -> None:
    answered = ask(scale, {"seconds": 9}, cancel_after_s=2.5)
    assert answered.answer is None
    assert answered.refused is not None
    assert (answered.refused.code, answered.took_s) == ("request.cancelled", 2.5)


def test_a_request_that_takes_too_long_ends_as_on_a_robot(scale: Scale) -> None:
    answered = ask(scale, {"seconds": 60}, cancel_after_s=30)
    assert answered.refused is not None
    assert (answered.refused.code, answered.took_s) == ("request.timeout", 10.0)


def test_what_was_taken_back_at_once_tells_nothing_and_takes_no_time() -> None:
    answered = ask(Scale("scale"), {"seconds": 5}, cancel_after_s=0)
    assert (answered.progress, answered.took_s) == ([], 0.0)


def test_what_is_no_question_never_reaches_the_body(scale: Scale) -> None:
    for question in ({"second": 1}, "{", b"\xff"):
        answered = ask(scale, question)
        assert answered.refused is not None
        assert answered.refused.code == "channel.invalid"


def test_the_body_may_refuse() -> None:
    assert ask(Scale("scale"), {"seconds": -1}).refused == RefusedMessage(0.0, "scale.time", "time runs forward")


def test_an_answer_that_is_not_what_the_class_says_fails_the_test() -> None:
    class Broken(RequestHandler[Weigh, Weight]):
        def answer(self, question: Weigh, request: Request) -> Weight:
            return {"grams": 1}  # type: ignore[return-value]

    with pytest.raises(ValueError, match="kilograms"):
        ask(Broken("broken"), {"seconds": 1})


def test_an_error_of_the_body_reaches_the_test(scale: Scale, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(**fields: object) -> None:
        raise RuntimeError("boom")

    monkeypatch.setattr(f"{__name__}.Weight", broken)
    with pytest.raises(RuntimeError, match="boom"):
        ask(scale, {"seconds": 0})


# -- async bodies on the fake clock ------------------------------------------------------------------------------------


class Slow(DataChannelSendable[str]):
    async def messages(self) -> AsyncIterator[str]:
        while True:
            await asyncio.sleep(600)
            yield "tick"


def test_an_async_sender_that_sleeps_is_collected_without_waiting() -> None:
    slow = Slow("slow")
    assert collect(slow, 3) == ["tick"] * 3
    assert fake_host(slow).clock.now_s == 1000 + 1800
    with pytest.raises(AssertionError, match="1 of 2 messages within 700 s"):
        collect(slow, 2, within_s=700)


def test_an_async_receiver_that_sleeps_is_overtaken_by_its_time_out() -> None:
    class Lift(DataChannelReceivable[Weigh]):
        timeout_s = 0.5

        async def handle_data(self, data: Weigh) -> None:
            await asyncio.sleep(data.seconds)

        def make_safe(self, cause: str) -> None:
            """Stands."""

    assert feed(Lift("lift"), [{"seconds": 2}]).made_safe == [
        MadeSafe(0.5, "safety.timeout"),
        MadeSafe(2.0, "safety.timeout"),
    ]


def test_time_stands_still_while_a_thread_works_or_a_socket_is_listened_to() -> None:
    class Reader(DataChannelSendable[str]):
        async def messages(self) -> AsyncIterator[str]:
            async with asyncio.timeout(60):
                await asyncio.to_thread(time.sleep, 0.01)
                yield "thread"
                ours, theirs = socket.socketpair()
                reader, writer = await asyncio.open_connection(sock=ours)
                asyncio.get_running_loop().run_in_executor(None, theirs.sendall, b"socket\n")
                yield (await reader.readline()).decode().strip()
                writer.close()
                theirs.close()

    reader = Reader("reader")
    assert collect(reader) == ["thread", "socket"]
    assert fake_host(reader).clock.now_s < 1010
