"""A stop holds until a person who may clears it."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.control.lease_events import Party
from mosaic_core.machines.control.stop_latch import MAX_IDS, StopLatch, StopTimes
from mosaic_core.words.codes import REASONS
from mosaic_core.words.control import Role

PERSON = Party("a", "sa", "Anna", is_person=True)


def stopped() -> StopLatch:
    latch = StopLatch()
    assert latch.stop("Anna", "a dog", "id1", 5.0)
    return latch


def test_a_stop_is_latched_with_who_why_and_when() -> None:
    latch = stopped()
    assert (latch.is_stopped, latch.by, latch.reason, latch.since_s) == (True, "Anna", "a dog", 5.0)


def test_a_robot_that_nobody_stopped_says_so() -> None:
    latch = StopLatch()
    assert (latch.is_stopped, latch.by, latch.reason, latch.since_s) == (False, "", "", None)


def test_another_stop_while_stopped_changes_nothing_but_is_acknowledged() -> None:
    latch = stopped()
    assert not latch.stop("Ben", "me too", "id2", 6.0)
    assert (latch.by, latch.since_s) == ("Anna", 5.0)
    assert latch.times("id2") == StopTimes(6.0, None)


def test_every_copy_is_acknowledged_with_the_time_of_the_first() -> None:
    latch = stopped()
    for copy in range(5):
        assert not latch.stop("Anna", "a dog", "id1", 5.03 + copy * 0.03)
    assert latch.times("id1") == StopTimes(5.0, None)


def test_the_acknowledgement_tells_when_everything_was_safe() -> None:
    latch = stopped()
    latch.made_safe(5.004)
    latch.made_safe(9.0)
    assert latch.times("id1") == StopTimes(5.0, 5.004)
    latch.stop("Ben", "", "id2", 7.0)
    assert latch.times("id2") == StopTimes(7.0, 7.0), "it was safe already when this one came"


def test_safe_actions_without_a_stop_make_no_later_one_safe() -> None:
    latch = StopLatch()
    latch.made_safe(1.0)
    latch.stop("Anna", "", "id1", 5.0)
    assert latch.times("id1") == StopTimes(5.0, None)


def test_an_unknown_stop_has_no_times() -> None:
    assert StopLatch().times("id1") is None
    assert stopped().times("other") is None


ROLES: tuple[Role, ...] = ("observer", "operator", "supervisor")


@pytest.mark.parametrize(
    ("role", "is_person", "is_original", "holds"), list(itertools.product(ROLES, *[[False, True]] * 3))
)
def test_only_a_person_who_holds_a_lease_or_supervises_clears(
    role: Role, is_person: bool, is_original: bool, holds: bool
) -> None:
    latch = stopped()
    code = latch.clear(Party("x", "sx", "X", role, is_person, is_original), holds)
    may = is_person and not is_original and (role == "supervisor" or (role == "operator" and holds))
    assert (code is None) == may
    assert code is None or code in REASONS
    assert latch.is_stopped != may
    is_program = not is_person and not is_original and role != "observer"
    assert (code == "safety.person_clears") == is_program, "the reason of a program, and of nobody else"


def test_clearing_what_is_not_stopped_is_no_error_for_who_may_and_forbidden_for_who_may_not() -> None:
    assert StopLatch().clear(PERSON, True) is None
    assert StopLatch().clear(PERSON, False) == "lease.required"
    assert StopLatch().clear(Party("p", "sp"), True) == "safety.person_clears"


def test_after_clearing_nothing_is_left_of_the_stop() -> None:
    latch = stopped()
    latch.clear(PERSON, True)
    assert (latch.is_stopped, latch.by, latch.reason, latch.since_s, latch.times("id1")) == (False, "", "", None, None)


def test_a_copy_that_arrives_after_clearing_stops_again() -> None:
    latch = stopped()
    latch.made_safe(5.01)
    latch.clear(PERSON, True)
    assert latch.stop("Anna", "a dog", "id1", 8.0), "its sender has not heard yet that it was obeyed"
    assert latch.times("id1") == StopTimes(8.0, None)


def test_thousands_of_stops_are_forgotten_but_for_the_newest() -> None:
    latch = StopLatch()
    for number in range(10_000):
        latch.stop("Anna", "", f"id{number}", float(number))
    assert latch.since_s == 0.0
    known = [number for number in range(10_000) if latch.times(f"id{number}") is not None]
    assert known == list(range(10_000 - MAX_IDS, 10_000))


STEPS = st.one_of(
    st.tuples(st.just("stop"), st.text(max_size=2), st.booleans(), st.booleans()),
    st.tuples(st.just("clear"), st.sampled_from(ROLES), st.booleans(), st.booleans()),
    st.tuples(st.just("safe"), st.just(""), st.booleans(), st.booleans()),
)


@given(st.lists(STEPS, max_size=50))
def test_between_a_stop_and_a_rightful_clear_it_is_always_stopped(
    walk: list[tuple[str, str, bool, bool]],
) -> None:
    latch, is_stopped = StopLatch(), False
    for now, (what, word, is_person, holds) in enumerate(walk):
        if what == "stop":
            assert latch.stop("x", "", word, float(now)) != is_stopped
            is_stopped = True
            assert latch.times(word) is not None
        elif what == "safe":
            latch.made_safe(float(now))
        elif word in ROLES and latch.clear(Party("x", "", "", word, is_person), holds) is None:
            is_stopped = False
        assert latch.is_stopped == is_stopped
