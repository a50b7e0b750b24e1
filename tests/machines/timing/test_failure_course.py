"""What a failure means: an absent device is looked for often, an error rarely, and each reason is news once."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.timing.failure_course import ABSENCE_POLICY, ERROR_POLICY, FailureCourse, FailureVerdict

GONE, ERROR, ALIVE = "gone", "error", "alive"


STEADY_S = ERROR_POLICY.stable_s


def fails(
    course: FailureCourse, reason: str = "why", *, is_absence: bool = False, ran_for_s: float = 0.0
) -> FailureVerdict:
    return course.failed(reason, is_absence=is_absence, ran_for_s=ran_for_s, random_unit=0.0)


def test_an_absent_device_is_looked_for_every_ten_seconds_at_the_latest() -> None:
    course = FailureCourse()
    assert [fails(course, is_absence=True).delay_s for _ in range(6)] == [1.0, 2.0, 4.0, 8.0, 10.0, 10.0]


def test_the_pauses_of_an_error_grow_to_half_a_minute() -> None:
    course = FailureCourse()
    assert [fails(course).delay_s for _ in range(8)] == [0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 30.0, 30.0]


def test_an_error_after_an_absence_begins_anew_and_so_does_an_absence_after_an_error() -> None:
    course = FailureCourse()
    delays = [fails(course, is_absence=one).delay_s for one in (True, True, False, False, True)]
    assert delays == [1.0, 2.0, 0.5, 1.0, 1.0]


def test_a_reason_is_news_once_until_it_changes_or_the_handler_worked() -> None:
    course = FailureCourse()
    assert [fails(course, reason).is_news for reason in ("a", "a", "b", "b", "a")] == [True, False, True, False, True]
    assert fails(course, "a", is_absence=True).is_news, "the same words for another kind"
    assert course.alive()
    assert not course.alive()
    assert fails(course, "a", is_absence=True).is_news


@pytest.mark.parametrize("is_absence", [True, False])
def test_what_works_for_a_moment_and_fails_the_same_way_again_is_told_once_more(is_absence: bool) -> None:
    course = FailureCourse()
    assert fails(course, is_absence=is_absence).is_news
    assert course.alive(), "it may have been mended"
    for is_news in (True, False, False):
        assert fails(course, is_absence=is_absence, ran_for_s=0.1).is_news is is_news
        assert not fails(course, is_absence=is_absence).is_news
        assert not course.alive()
    assert fails(course, "another").is_news
    assert course.alive()


def test_what_works_for_a_while_after_a_relapse_is_back_and_that_is_told_once() -> None:
    course = FailureCourse()
    for ran_for_s in (0.0, 0.1):
        fails(course, ran_for_s=ran_for_s)
        course.alive()
    told = [course.alive(works_for_s) for works_for_s in (0.1, STEADY_S - 0.1, STEADY_S, STEADY_S + 1)]
    assert told == [False, False, True, False]
    assert fails(course, ran_for_s=STEADY_S).is_news
    assert course.alive()


def test_what_worked_for_a_while_and_fails_the_same_way_again_is_news() -> None:
    course = FailureCourse()
    briefly = STEADY_S - 0.1
    course_of = ((0.0, True, True), (briefly, True, False), (briefly, False, False), (STEADY_S, True, True))
    for ran_for_s, is_news, is_back in (*course_of, (STEADY_S, True, True)):
        assert fails(course, ran_for_s=ran_for_s).is_news is is_news
        assert course.alive() is is_back


EVENTS = st.tuples(
    st.sampled_from([GONE, ERROR, ALIVE]), st.sampled_from("ab"), st.floats(0, 100), st.floats(0, 1, exclude_max=True)
)


@given(st.lists(EVENTS))
def test_whatever_happens_it_is_tried_again_in_time_and_told_once_for_each_change(
    happened: list[tuple[str, str, float, float]],
) -> None:
    course, told, last, is_relapse = FailureCourse(), None, None, False
    for what, reason, ran_for_s, unit in happened:
        if what == ALIVE:
            assert course.alive() is (told is not None and not is_relapse)
            told = None
        else:
            verdict = course.failed(reason, is_absence=what == GONE, ran_for_s=ran_for_s, random_unit=unit)
            policy = ABSENCE_POLICY if what == GONE else ERROR_POLICY
            assert policy.first_s * (1 - policy.jitter) <= verdict.delay_s <= policy.max_s
            is_repeated = last == (what, reason) and ran_for_s < STEADY_S
            was_relapse = is_relapse
            if told != (what, reason):
                is_relapse = told is None and is_repeated
            assert verdict.is_news is (told != (what, reason) and not (is_relapse and was_relapse))
            told = last = (what, reason)
        assert course.is_failing is (told is not None)
