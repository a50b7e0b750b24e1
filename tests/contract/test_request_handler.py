"""What a request handler may say is checked when its class is made."""

from __future__ import annotations

from typing import Any

import pytest

from mosaic_core import Delivery, Message, MosaicDataType, Request, RequestHandler
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


def test_progress_that_is_no_json_is_told_to_its_author() -> None:
    with pytest.raises(ValueError, match="JSON"):
        Request().progress(float("nan"))


@pytest.mark.parametrize(
    ("written", "mistake"),
    [
        ({"handle_data": lambda self, data: None}, "instead of `handle_data`"),
        ({"timeout_s": 1.0}, "`answer_within_s`"),
        ({"motion_fields": ("n",)}, "`motion_fields`"),
        ({"delivery": Delivery.LATEST}, "`reliable`"),
        ({"at_once": 0}, "positive"),
        ({"answer": lambda self, question: None}, "these two arguments"),
    ],
)
def test_what_can_not_be_meant_is_told_at_once(written: dict[str, Any], mistake: str) -> None:
    with pytest.raises(TypeError, match=mistake):
        type("Wrong", (Twice,), written)


def test_a_question_must_be_told_from_its_envelope() -> None:
    class Confusing(Message):
        id: str
        question: str

    with pytest.raises(TypeError, match="numbered request"):

        class _Wrong(RequestHandler[Confusing, Reply]):
            def answer(self, question: Confusing, request: Request) -> Reply:
                return Reply(n=1)
