from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.media.talk_floor import MAX_OTHERS, SILENCE_S, TalkFloor


def test_who_comes_first_is_heard_and_the_other_is_told_once() -> None:
    floor = TalkFloor()
    assert floor.heard("ann", 0.0) == "heard"
    assert floor.heard("bob", 0.1) == "refused"
    assert floor.heard("bob", 0.2) == "refused again"
    assert floor.heard("ann", 0.3) == "heard"


def test_after_half_a_second_of_silence_the_floor_is_free() -> None:
    floor = TalkFloor()
    floor.heard("ann", 0.0)
    assert floor.silent_at_s() == SILENCE_S
    assert floor.holder(SILENCE_S) == "ann"
    assert floor.holder(SILENCE_S + 0.01) is None
    assert floor.heard("bob", SILENCE_S + 0.02) == "heard"
    assert floor.heard("ann", SILENCE_S + 0.03) == "refused"


def test_a_new_attempt_is_told_anew() -> None:
    floor = TalkFloor()
    for step in range(30):
        floor.heard("ann", step * 0.1)
    assert floor.heard("bob", 0.1) == "refused"
    assert floor.heard("bob", 0.1 + SILENCE_S + 0.01) == "refused"


def test_who_leaves_frees_the_floor_at_once() -> None:
    floor = TalkFloor()
    floor.heard("ann", 0.0)
    assert not floor.left("bob")
    assert floor.left("ann")
    assert floor.heard("bob", 0.0) == "heard"


def test_who_left_and_comes_back_is_told_anew() -> None:
    floor = TalkFloor()
    floor.heard("ann", 0.0)
    assert floor.heard("bob", 0.1) == "refused"
    floor.left("eve")
    assert floor.heard("bob", 0.2) == "refused again"
    floor.left("bob")
    assert floor.heard("bob", 0.3) == "refused"


def test_who_was_heard_meanwhile_is_told_anew() -> None:
    floor = TalkFloor()
    floor.heard("ann", 0.0)
    assert floor.heard("bob", 0.1) == "refused"
    floor.left("ann")
    assert floor.heard("bob", 0.2) == "heard"
    floor.left("bob")
    floor.heard("ann", 0.3)
    assert floor.heard("bob", 0.4) == "refused"


def test_who_was_told_longest_ago_is_forgotten_first() -> None:
    floor = TalkFloor()
    floor.heard("ann", 0.0)
    for number in range(MAX_OTHERS):
        floor.heard(f"other {number}", 0.1)
    floor.heard("other 0", 0.2)
    floor.heard("one more", 0.2)
    assert floor.heard("other 0", 0.3) == "refused again"
    assert floor.heard("other 1", 0.3) == "refused"


def test_who_may_not_talk_is_refused_even_when_nobody_does() -> None:
    floor = TalkFloor()
    assert floor.heard("eve", 0.0, may_talk=False) == "refused"
    assert floor.holder(0.0) is None
    assert floor.heard("ann", 0.1) == "heard"


def test_a_talker_who_lost_the_right_does_not_keep_the_floor() -> None:
    floor = TalkFloor()
    floor.heard("ann", 0.0)
    assert floor.heard("ann", 0.1, may_talk=False) == "refused"
    assert floor.holder(SILENCE_S + 0.1) is None


@given(st.lists(st.tuples(st.sampled_from("abcd"), st.floats(0, 1), st.booleans(), st.booleans())))
def test_at_most_one_is_heard_at_a_time_and_only_who_may(steps: list[tuple[str, float, bool, bool]]) -> None:
    floor, now_s = TalkFloor(), 0.0
    heard_at: dict[str, float] = {}
    for talker, pause_s, may_talk, leaves in steps:
        now_s += pause_s
        if leaves:
            floor.left(talker)
            heard_at.pop(talker, None)
            continue
        if floor.heard(talker, now_s, may_talk=may_talk) == "heard":
            assert may_talk
            assert all(now_s - at_s > SILENCE_S for other, at_s in heard_at.items() if other != talker)
            heard_at[talker] = now_s
            assert floor.holder(now_s) == talker
        elif may_talk:
            assert floor.holder(now_s) not in (None, talker)


def test_memory_is_bounded_whoever_comes() -> None:
    floor = TalkFloor()
    floor.heard("ann", 0.0)
    for number in range(10 * MAX_OTHERS):
        assert floor.heard(f"other {number}", 0.1) == "refused"
    assert len(floor._told_at_s) <= MAX_OTHERS
