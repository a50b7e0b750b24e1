"""The watchdog fires once per silence."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.commands.watchdog import Watchdog


def test_it_fires_once_when_the_time_is_over() -> None:
    dog = Watchdog(0.3)
    assert dog.due_at_s is None
    dog.feed("p", 1.0)
    assert dog.due_at_s == pytest.approx(1.3)
    assert not dog.expire(1.29)
    assert dog.expire(1.3)
    assert not dog.expire(99.0)
    assert dog.due_at_s is None


def test_it_never_fires_before_a_first_command_and_never_without_a_time_out() -> None:
    assert not Watchdog(0.3).expire(99.0)
    dog = Watchdog(None)
    dog.feed("p", 0.0)
    assert not dog.expire(1e9)
    assert dog.peer_left("p"), "it still knows who commanded"


def test_the_commander_leaving_is_told_once_and_others_do_not_matter() -> None:
    dog = Watchdog(0.3)
    dog.feed("a", 0.0)
    dog.feed("b", 0.1)
    assert not dog.peer_left("a")
    assert dog.peer_left("b")
    assert not dog.peer_left("b")


def test_a_refused_command_leaves_the_deadline_where_it_was() -> None:
    dog = Watchdog(0.3)
    dog.feed("a", 0.0)
    dog.unfeed(dog.feed("b", 0.2))
    assert dog.due_at_s == pytest.approx(0.3)
    assert dog.peer_left("a")


def test_a_refused_first_command_disarms() -> None:
    dog = Watchdog(0.3)
    dog.unfeed(dog.feed("a", 0.0))
    assert dog.due_at_s is None


def test_a_command_that_ended_with_an_error_stays_armed_and_moves_no_deadline() -> None:
    dog = Watchdog(0.3)
    dog.keep_deadline(dog.feed("a", 0.0))
    assert dog.due_at_s == pytest.approx(0.3)
    dog.keep_deadline(dog.feed("a", 0.2))
    assert dog.due_at_s == pytest.approx(0.3)
    before = dog.feed("a", 0.25)
    assert dog.expire(0.6)
    dog.keep_deadline(before)
    assert dog.due_at_s is None


def test_a_refusal_after_the_safe_action_does_not_arm_again() -> None:
    dog = Watchdog(0.3)
    dog.feed("a", 0.0)
    before = dog.feed("a", 0.1)
    assert dog.expire(0.5)
    dog.unfeed(before)
    assert dog.due_at_s is None


def test_disarm_ends_the_watch() -> None:
    dog = Watchdog(0.3)
    dog.feed("a", 0.0)
    dog.disarm()
    assert not dog.expire(1.0)


@pytest.mark.parametrize("timeout_s", [0.0, -1.0, float("nan")])
def test_a_time_out_must_be_positive(timeout_s: float) -> None:
    with pytest.raises(ValueError, match="positive"):
        Watchdog(timeout_s)


@given(st.lists(st.tuples(st.booleans(), st.floats(0.001, 0.5)), max_size=60))
def test_over_any_history_it_fires_exactly_when_the_last_command_is_too_old(history: list[tuple[bool, float]]) -> None:
    dog, now_s, last_s = Watchdog(0.3), 0.0, None
    for is_command, step_s in history:
        now_s += step_s
        if is_command:
            dog.feed("p", now_s)
            last_s = now_s
        else:
            expected = last_s is not None and now_s >= last_s + 0.3
            assert dog.expire(now_s) is expected
            if expected:
                last_s = None


def test_it_is_armed_from_the_first_command_to_the_safe_action() -> None:
    dog = Watchdog(1.0)
    due_s = [dog.due_at_s]
    dog.feed("a", 5.0)
    due_s.append(dog.due_at_s)
    dog.expire(6.0)
    assert [*due_s, dog.due_at_s] == [None, 6.0, None]
