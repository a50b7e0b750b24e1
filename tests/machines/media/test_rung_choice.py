"""Down at once, up slowly, and slower after each attempt that failed."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.media.rung_choice import FIRST_HOLD_S, LONGEST_HOLD_S, STEADY_S, RungChoice
from mosaic_core.machines.media.rung_ladder import ladder

RUNGS = ladder(1280, 720, min_bps=150_000, max_bps=2_800_000, rungs=3)
POOR, RICH = 200_000, 2_800_000


def test_it_starts_on_the_best_rung_that_the_budget_affords() -> None:
    assert RungChoice(RUNGS, RICH, 0.0).index == 0
    assert RungChoice(RUNGS, RUNGS[1].floor_bps, 0.0).index == 1
    assert RungChoice(RUNGS, 0, 0.0).index == 2


def test_it_goes_down_at_once_and_as_far_as_needed() -> None:
    assert RungChoice(RUNGS, RICH, 0.0).decide(POOR, 0.01) == 2


def test_it_goes_up_one_rung_at_a_time_and_only_when_it_lasts() -> None:
    choice = RungChoice(RUNGS, POOR, 0.0)
    assert choice.decide(RICH, 1.0) == 2
    assert choice.decide(RICH, 1.0 + STEADY_S / 2) == 2
    assert choice.decide(POOR, 1.0 + STEADY_S * 0.8) == 2, "it did not last"
    assert choice.decide(RICH, 3.0) == 2
    assert choice.decide(RICH, 3.0 + STEADY_S) == 1
    assert choice.decide(RICH, 3.1 + STEADY_S) == 1
    assert choice.decide(RICH, 3.2 + 2 * STEADY_S) == 0


def test_it_goes_up_only_when_it_may() -> None:
    answers = iter([False, True])
    choice = RungChoice(RUNGS, RUNGS[1].floor_bps, 0.0, lambda: next(answers))
    start = choice.index
    choice.decide(RICH, 1.0)
    assert choice.decide(RICH, 1.0 + STEADY_S) == start
    assert choice.decide(RICH, 1.1 + STEADY_S) == start - 1


def test_after_a_step_down_it_waits_and_longer_when_the_step_up_was_the_mistake() -> None:
    choice, now_s, waits_s = RungChoice(RUNGS, RICH, 0.0), 0.0, []
    for _ in range(6):
        choice.decide(RUNGS[1].ceiling_bps, now_s)  # too little for the best rung, all of the middle one
        choice.decide(RUNGS[0].floor_bps - 1, now_s)
        went_down_at_s = now_s
        while choice.decide(RICH, now_s) != 0:
            now_s += 0.1
        waits_s.append(round(now_s - went_down_at_s, 3))
        now_s += 1.0
    assert waits_s[0] >= FIRST_HOLD_S
    assert waits_s == sorted(waits_s)
    assert waits_s[-1] > 4 * waits_s[0]
    assert waits_s[-1] <= LONGEST_HOLD_S + STEADY_S + 1.0


def test_a_step_down_long_after_the_step_up_is_no_mistake() -> None:
    choice = RungChoice(RUNGS, POOR, 0.0)
    for tenth in range(100):
        choice.decide(RICH, tenth / 10)
    choice.decide(POOR, 30.0)
    for tenth in range(100):
        choice.decide(RICH, 30.0 + tenth / 10)
    assert choice.index < 2


def test_another_ladder_under_the_same_link_keeps_what_was_learned() -> None:
    choice = RungChoice(RUNGS, RICH, 0.0)
    choice.decide(RUNGS[0].floor_bps - 1, 1.0)
    choice.stand_on(RUNGS[1:], 0)
    assert choice.decide(RICH, 2.0) == 0
    choice.stand_on(RUNGS, 1)
    assert choice.decide(RICH, 3.0) == 1
    assert choice.decide(RICH, 3.0 + 2 * STEADY_S) == 1, "it still waits"
    assert choice.decide(RICH, 1.0 + FIRST_HOLD_S) == 0


@given(st.lists(st.tuples(st.integers(0, 4_000_000), st.floats(0, 5)), max_size=60))
def test_it_is_always_on_a_rung_that_the_budget_affords_unless_it_is_the_last(steps: list[tuple[int, float]]) -> None:
    choice, now_s = RungChoice(RUNGS, POOR, 0.0), 0.0
    for budget_bps, passed_s in steps:
        now_s += passed_s
        before = choice.index
        index = choice.decide(budget_bps, now_s)
        assert index == len(RUNGS) - 1 or budget_bps >= RUNGS[index].floor_bps
        assert index >= before - 1, "never two rungs up at once"
