"""What a request handler may say is checked when its class is made."""

from __future__ import annotations

from typing import Any

import pytest

from mosaic_core import Delivery, Message, MosaicDataType, MosaicError, Request, RequestHandler
from mosaic_core.contract.handler import message_type_of
from mosaic_core.contract.request_handler import answer_type_of


class Ask(Message):
    n: int


class Reply(Message):
    n: int


class Twice(RequestHandler[Ask, Reply]):
    def answer(self, question: Ask, request: Request) -> Reply:
        request.progress(Reply(n=0))
        return Reply(n=2 * question.n)


def test_its_types_are_those_that_are_written() -> None:
    assert message_type_of(Twice) is Ask
    assert answer_type_of(Twice) is Reply
    assert Twice.data_type is MosaicDataType.JSON_BI


def test_it_can_be_asked_without_a_robot() -> None:
    told: list[Any] = []
    assert Twice("twice").answer(Ask(n=2), Request(told=told.append)) == Reply(n=4)
    assert told == [{"n": 0}]


def test_a_cancelled_request_tells_nothing_more_and_waits_no_longer() -> None:
    told: list[Any] = []
    request = Request(told=told.append)
    assert not request.pause(0.0)
    request.cancel()
    request.progress(1)
    assert (told, request.is_cancelled, request.pause(10.0)) == ([], True, True)


async def test_a_pause_in_an_async_body_is_refused_with_its_line() -> None:
    with pytest.raises(
        MosaicError, match=r"request\.pause\(…\) in an `async def` .*test_request_handler\.py"
    ) as refused:
        Request().pause(0.0)
    assert refused.value.cure.startswith("Write `await asyncio.sleep(…)`")


def test_progress_that_is_no_json_is_told_to_its_author() -> None:
    with pytest.raises(ValueError, match="JSON"):
        Request().progress(float("nan"))


def plain(self: Any, question: Any) -> None:
    """Does not take the request."""


@pytest.mark.parametrize(
    ("written", "mistake"),
    [
        ({"handle_data": plain}, "a request is not handled by `handle_data`. Write `answer(self, question, request)`"),
        ({"timeout_s": 1.0}, "`timeout_s` is for receivers that move something on and on. Write `answer_within_s`"),
        ({"motion_fields": ("n",)}, "a question has no `motion_fields`. Bound its numbers in its model"),
        ({"delivery": Delivery.LATEST}, "a request can't be delivered as latest. Write `Delivery.RELIABLE`"),
        ({"at_once": 0}, "at_once is 0, and no number of requests. Write 1 or more."),
        ({"at_once": True}, "at_once is True, and no number of requests."),
        ({"answer_within_s": "10"}, "answer_within_s is '10', and no number of seconds. Write seconds above 0, such"),
        ({"answer_within_s": 0}, "answer_within_s is 0, and no number of seconds."),
        ({"answer": plain}, "answer can't be called with (question, request): too many positional arguments."),
    ],
)
def test_what_can_not_be_meant_is_told_at_once(written: dict[str, Any], mistake: str) -> None:
    with pytest.raises(MosaicError) as refused:
        type("Wrong", (Twice,), {**written, "__module__": __name__})
    assert str(refused.value).startswith(f"{__file__}:")
    assert mistake in str(refused.value)


def test_a_question_must_be_told_from_its_envelope() -> None:
    class Confusing(Message):
        id: str
        question: str

    with pytest.raises(MosaicError, match="numbered request"):

        class _Wrong(RequestHandler[Confusing, Reply]):
            def answer(self, question: Confusing, request: Request) -> Reply:
                return Reply(n=1)
