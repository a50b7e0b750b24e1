"""Requests on the robot: each ends once, for the one who asked, and no more of them are open than there is room for."""

from __future__ import annotations

import json
from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.requests.answering import MAX_OPEN, MAX_OPEN_OF_ONE, PROGRESS_HZ, Answering
from mosaic_core.machines.requests.request_words import (
    RequestAnswer,
    RequestProgress,
    RequestRefusal,
    RequestReply,
    reply_of,
    reply_text,
)
from mosaic_core.words.errors import Refused

WITHIN_S = 10.0


def begun(it: Answering, asker: str = "a", request_id: str | None = "1", now_s: float = 0.0) -> int:
    number = it.arrived(asker, request_id, now_s)
    it.admitted(number)
    assert it.next_to_begin() == number
    return number


def test_an_answer_goes_to_whoever_asked_under_its_id_and_once() -> None:
    it = Answering(4, WITHIN_S)
    number = begun(it)
    told = it.answered(number, 42)
    assert told is not None
    assert (told.asker, told.word) == ("a", RequestAnswer("1", 42))
    assert it.answered(number, 43) is None
    assert it.refused(number, "x") is None


def test_so_many_begin_at_once_and_a_body_keeps_its_place_until_it_returns() -> None:
    it = Answering(1, WITHIN_S)
    first = begun(it)
    second = it.arrived("b", "1", 0.0)
    it.admitted(second)
    it.cancelled("a", "1")
    assert it.next_to_begin() is None
    it.body_returned(first)
    assert it.next_to_begin() == second


def test_an_id_is_free_again_when_its_request_has_ended() -> None:
    it = Answering(4, WITHIN_S)
    number = begun(it)
    with pytest.raises(Refused, match=r"request\.duplicate_id"):
        it.arrived("a", "1", 0.0)
    it.arrived("b", "1", 0.0)
    it.answered(number, None)
    it.arrived("a", "1", 0.0)


def test_questions_without_an_id_do_not_meet() -> None:
    it = Answering(4, WITHIN_S)
    assert begun(it, request_id=None) != begun(it, request_id=None)


def test_one_operator_and_all_of_them_have_so_many_open() -> None:
    it = Answering(4, WITHIN_S)
    for number in range(MAX_OPEN_OF_ONE):
        it.arrived("a", str(number), 0.0)
    with pytest.raises(Refused, match=r"request\.too_many"):
        it.arrived("a", "more", 0.0)
    for number in range(MAX_OPEN - MAX_OPEN_OF_ONE):
        it.arrived(f"b{number}", "1", 0.0)
    with pytest.raises(Refused, match=r"request\.too_many"):
        it.arrived("c", "1", 0.0)


def test_nobody_takes_back_anothers_request() -> None:
    it = Answering(4, WITHIN_S)
    begun(it)
    assert it.cancelled("b", "1") is None
    told = it.cancelled("a", "1")
    assert told is not None
    assert told.word == RequestRefusal("1", "request.cancelled")


@pytest.mark.parametrize("number", ["7", None])
@pytest.mark.parametrize("kind", [RequestAnswer, RequestProgress])
def test_what_a_robot_says_is_read_as_it_was_said(
    kind: type[RequestAnswer] | type[RequestProgress], number: str | None
) -> None:
    said: tuple[RequestReply, ...] = (kind(number, {"done": 3}), RequestRefusal(number, "arm.moving", "it moves"))
    assert [reply_of(json.dumps(reply_text(one)).encode()) for one in said] == list(said)


def test_progress_is_thinned_to_the_newest() -> None:
    it = Answering(4, WITHIN_S)
    number = begun(it)
    assert it.progressed(number, 1, 1.0) is not None
    assert it.progressed(number, 2, 1.01) is None
    assert it.progressed(number, 3, 1.02) is None
    due_s = it.deadline_s
    assert due_s == pytest.approx(1.0 + 1 / PROGRESS_HZ)
    assert [told.word for told in it.time_passed(due_s)] == [RequestProgress("1", 3)]


def test_what_is_not_answered_in_time_ends() -> None:
    it = Answering(4, WITHIN_S)
    it.arrived("a", "1", 0.0)
    assert it.deadline_s == WITHIN_S
    assert it.time_passed(WITHIN_S - 0.1) == []
    assert [told.word for told in it.time_passed(WITHIN_S)] == [RequestRefusal("1", "request.timeout")]
    assert it.deadline_s is None


def test_an_operator_that_goes_on_as_another_peer_is_answered_there() -> None:
    it = Answering(4, WITHIN_S)
    number = begun(it)
    it.handed_over("a", "a2")
    assert it.left("a") == []
    told = it.answered(number, 1)
    assert told is not None
    assert told.asker == "a2"


def test_what_was_dropped_before_its_turn_is_refused_and_nothing_else() -> None:
    it = Answering(4, WITHIN_S)
    begun(it, request_id="begun")
    it.arrived("a", "waits", 0.0)
    it.arrived("b", "waits", 0.0)
    assert [(told.asker, told.word.id) for told in it.dropped("a", "request.lost")] == [("a", "waits")]
    assert [told.asker for told in it.dropped(None, "safety.stopped")] == ["b"]
    assert len(it) == 1


def test_all_are_refused_when_the_handler_stops() -> None:
    it = Answering(1, WITHIN_S)
    begun(it)
    it.arrived("b", None, 0.0)
    assert [told.word for told in it.close()] == [
        RequestRefusal("1", "request.stopped"),
        RequestRefusal(None, "request.stopped"),
    ]


STEPS = st.one_of(
    st.tuples(st.just("ask"), st.sampled_from("abc"), st.sampled_from(["1", "2", "3", None])),
    st.tuples(st.just("cancel"), st.sampled_from("abc"), st.sampled_from("123")),
    st.tuples(st.sampled_from(["admit", "answer", "fail", "return", "progress"]), st.integers(1, 30), st.none()),
    st.tuples(st.sampled_from(["begin", "wait", "drop"]), st.none(), st.none()),
    st.tuples(st.just("leave"), st.sampled_from("abc"), st.none()),
)


@given(st.lists(STEPS, max_size=80), st.integers(1, 3))
def test_every_request_ends_exactly_once_for_its_asker(steps: list[tuple[str, object, object]], at_once: int) -> None:
    it, now_s = Answering(at_once, WITHIN_S), 0.0
    asked: dict[int, tuple[str, str | None]] = {}
    ends: Counter[int] = Counter()
    bodies: set[int] = set()

    def heard(*words: object) -> None:
        for told in filter(None, words):
            assert (told.asker, told.word.id) == asked[told.number]  # type: ignore[attr-defined]
            assert not ends[told.number]  # type: ignore[attr-defined]
            ends[told.number] += told.is_end  # type: ignore[attr-defined]

    for what, one, other in steps:
        now_s += 0.3
        match what:
            case "ask":
                try:
                    asked[it.arrived(str(one), other, now_s)] = (str(one), other)  # type: ignore[arg-type]
                except Refused:
                    live = [key for number, key in asked.items() if not ends[number]]
                    assert (one, other) in live or len(live) >= MAX_OPEN_OF_ONE
            case "cancel":
                heard(it.cancelled(str(one), str(other)))
            case "admit":
                it.admitted(one)  # type: ignore[arg-type]
            case "answer":
                heard(it.answered(one, "answer"))  # type: ignore[arg-type]
            case "fail":
                heard(it.refused(one, "request.failed"))  # type: ignore[arg-type]
            case "progress":
                heard(it.progressed(one, now_s, now_s))  # type: ignore[arg-type]
            case "return":
                it.body_returned(one)  # type: ignore[arg-type]
                bodies.discard(one)  # type: ignore[arg-type]
            case "begin":
                number = it.next_to_begin()
                if number is not None:
                    assert not ends[number]
                    bodies.add(number)
            case "wait":
                now_s += 3.0
                heard(*it.time_passed(now_s))
            case "drop":
                heard(*it.dropped(None, "safety.stopped"))
            case "leave":
                for number in it.left(str(one)):
                    ends[number] += 1
        assert len(bodies) <= at_once
    heard(*it.close())
    assert len(it) == 0
    assert all(ends[number] == 1 for number in asked)
