"""The kit asks a request handler as an operator does: progress, cancel, refusals, all on the fake clock."""

from __future__ import annotations

import asyncio
import math
import socket
import time
from collections.abc import AsyncIterator
from typing import Any

import numpy as np
import pytest
from pydantic import BaseModel, ConfigDict, Field

from mosaic_core import (
    DataChannelConfigurer,
    DataChannelReceivable,
    DataChannelSendable,
    Message,
    MosaicError,
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


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (None, "declares Weight and answers NoneType (answer: "),
        ({"grams": 1}, "declares Weight and answers dict (kilograms: Field required; of: Field required; "),
        (
            {"kilogram": 1, "of": "Bob"},
            "declares Weight and answers dict (kilograms: Field required; no field 'kilogram'",
        ),
        (
            {"kilograms": 1, "of": "Bob", "off": 3},
            "declares Weight and answers dict (no field 'off': did you mean 'of'?)",
        ),
        ({"kilograms": math.nan, "of": "Alice"}, "declares Weight and answers dict (answer: Value error, kilograms is"),
        (Weight.model_construct(kilograms=1.0, of=math.nan), "answers what Weight does not declare: Expected `str`"),
        (Weight(kilograms=1, of="caf\udce9"), "answers 'of' as text with half a character, which JSON does not know: "),
        (Weight(kilograms=math.nan, of="Alice"), "answers 'kilograms', which is no finite number and not declared as"),
    ],
)
def test_an_answer_that_is_not_what_the_class_says_is_told_with_class_line_and_field(answer: Any, said: str) -> None:
    class Broken(RequestHandler[Weigh, Weight]):
        def answer(self, question: Weigh, request: Request) -> Weight:
            return answer  # type: ignore[no-any-return]

    with pytest.raises(MosaicError) as caught:
        ask(Broken("broken"), {"seconds": 1})
    place = f"{__file__}:{Broken.answer.__code__.co_firstlineno}"
    assert caught.value.message.startswith(f"{Broken.__qualname__}.answer ({place}) {said}")
    assert caught.value.code == "plugin.wrong_message"


def test_an_answer_of_a_class_of_its_kind_has_all_its_fields() -> None:
    class Exact(Weight):
        error_g: float

    class Careful(RequestHandler[Weigh, Weight]):
        def answer(self, question: Weigh, request: Request) -> Weight:
            return Exact(kilograms=1, of="Bob", error_g=2)

    assert ask(Careful("careful"), {"seconds": 1}).answer == {"kilograms": 1.0, "of": "Bob", "error_g": 2.0}


def test_an_answer_that_no_class_declares_is_told_by_the_field_that_json_does_not_know() -> None:
    class Raw(RequestHandler[Weigh, dict]):  # type: ignore[type-arg]
        def answer(self, question: Weigh, request: Request) -> dict[str, Any]:
            return {"weights": [np.float32(1)]}

    with pytest.raises(
        MosaicError, match=r"answers what dict does not declare: 'weights\.0' as float32, .* write float"
    ):
        ask(Raw("raw"), {"seconds": 1})


def test_a_refusal_may_name_a_file_whose_name_is_no_text() -> None:
    class Looks(RequestHandler[Weigh, Weight]):
        def answer(self, question: Weigh, request: Request) -> Weight:
            raise Refused("files.unreadable", "caf\udce9.txt")

    assert ask(Looks("looks"), {"seconds": 1}).refused == RefusedMessage(0.0, "files.unreadable", r"caf\udce9.txt")


def test_a_number_of_an_answer_that_may_be_absent_is_null() -> None:
    class Perhaps(Message):
        kilograms: float | None

    class Doubtful(RequestHandler[Weigh, dict[str, Perhaps]]):
        def answer(self, question: Weigh, request: Request) -> dict[str, Perhaps]:
            perhaps = Perhaps(kilograms=1.0)
            perhaps.kilograms = math.nan
            return {"left": perhaps}

    assert ask(Doubtful("doubtful"), {"seconds": 1}).answer == {"left": {"kilograms": None}}


def test_keys_of_an_answer_that_its_model_keeps_are_answered() -> None:
    class Open(Message, extra="allow"):
        kilograms: float

    class Talkative(RequestHandler[Weigh, Open]):
        def answer(self, question: Weigh, request: Request) -> Open:
            return {"kilograms": 1.0, "grams": 1000}  # type: ignore[return-value]

    assert ask(Talkative("talkative"), {"seconds": 1}).answer == {"kilograms": 1.0, "grams": 1000}


@pytest.mark.parametrize("value", [{1, 2}, math.nan, Weight])
def test_progress_that_is_no_json_is_told_with_what_it_takes(value: Any) -> None:
    class Vague(RequestHandler[Weigh, Weight]):
        def answer(self, question: Weigh, request: Request) -> Weight:
            request.progress(value)
            raise AssertionError

    with pytest.raises((TypeError, ValueError), match=r"request\.progress takes a message, or what is JSON: .+"):
        ask(Vague("vague"), {"seconds": 1})


class Spot(Message):
    x_m: float = 0.0


class Kept(BaseModel):
    model_config = ConfigDict(extra="allow")


class Way(Message):
    folder: str = Field(default=".", validation_alias="in")
    spots: list[Spot] = Field(default=[])
    notes: dict[str, Any] = Field(default={})
    kept: Kept = Kept()


class Guide(RequestHandler[Way, dict[str, Any]]):
    def answer(self, question: Way, request: Request) -> dict[str, Any]:
        return question.kept.model_dump()


@pytest.mark.parametrize(
    ("question", "said"),
    [
        ({"spotss": []}, "no field 'spotss': did you mean 'spots'?"),
        ({"spots": [{"x_m": 1}, {"x_mm": 1}]}, "no field 'x_mm': did you mean 'x_m'?"),
        ({"zzz": 1}, "no field 'zzz'"),
        ({"spots": 3, "ni": "maps"}, "spots: Input should be a valid list; no field 'ni'"),
        ({"folder": "maps"}, "no field 'folder'"),
        ({"x" * 999: 1}, f"no field '{'x' * 40}'"),
    ],
)
def test_a_misspelt_key_of_a_question_is_refused_with_the_nearest(question: dict[str, Any], said: str) -> None:
    assert ask(Guide("guide"), question).refused == RefusedMessage(0.0, "channel.invalid", said)


def test_keys_that_a_question_keeps_are_taken() -> None:
    asked = ask(Guide("guide"), {"in": "maps", "notes": {"any": 1}, "kept": {"of": "its author"}})
    assert (asked.refused, asked.answer) == (None, {"of": "its author"})


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
