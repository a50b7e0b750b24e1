"""Requests of an operator: each gets one end, and nobody another's answer."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.requests.asking import MAX_ASKED, Asking, LostRequest
from mosaic_core.machines.requests.request_words import RequestAnswer, RequestProgress, RequestRefusal


def test_an_answer_ends_its_request_and_progress_does_not() -> None:
    it = Asking("p")
    number = it.asked(10.0)
    assert it.heard(RequestProgress(number, 1)) == RequestProgress(number, 1)
    assert it.heard(RequestAnswer(number, 2)) == RequestAnswer(number, 2)
    assert it.heard(RequestAnswer(number, 3)) is None
    assert it.deadline_s is None


def test_a_refusal_ends_it_too() -> None:
    it = Asking("p")
    number = it.asked(10.0)
    assert it.heard(RequestRefusal(number, "x")) is not None
    assert len(it) == 0


def test_what_was_never_asked_is_for_nobody() -> None:
    it = Asking("p")
    it.asked(10.0)
    assert it.heard(RequestAnswer("q-1", 1)) is None
    assert it.heard(RequestAnswer(None, 1)) is None


def test_what_gets_no_answer_in_time_ends() -> None:
    it = Asking("p")
    early, late = it.asked(1.0), it.asked(2.0)
    assert it.time_passed(1.5) == [LostRequest(early, "request.timeout")]
    assert it.deadline_s == 2.0
    assert it.lost("request.lost") == [LostRequest(late, "request.lost")]
    assert not it.forgotten(late)


def test_no_more_are_open_than_a_robot_takes() -> None:
    it = Asking("p")
    for _ in range(MAX_ASKED):
        assert it.has_room
        it.asked(1.0)
    assert not it.has_room


@given(st.lists(st.tuples(st.sampled_from(["ask", "hear", "forget", "wait", "lose"]), st.integers(1, 12))))
def test_every_request_ends_exactly_once(steps: list[tuple[str, int]]) -> None:
    it, ended, asked, now_s = Asking("p"), list[str](), list[str](), 0.0
    for what, number in steps:
        now_s += 1.0
        match what:
            case "ask":
                asked.append(it.asked(now_s + number))
            case "hear":
                reply = it.heard(RequestAnswer(f"p-{number}", number))
                ended += [] if reply is None else [str(reply.id)]
            case "forget":
                ended += [f"p-{number}"] if it.forgotten(f"p-{number}") else []
            case "wait":
                ended += [one.id for one in it.time_passed(now_s)]
            case "lose":
                ended += [one.id for one in it.lost("request.lost")]
    ended += [one.id for one in it.lost("request.lost")]
    assert sorted(ended) == sorted(asked)
    assert len(set(asked)) == len(asked)
