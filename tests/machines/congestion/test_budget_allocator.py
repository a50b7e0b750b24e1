"""A budget is divided: everyone's least first, then by rank and weight, and nothing is left that somebody can use."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.congestion.budget_allocator import DRIVES, SEEN, Demand, allocated

amounts = st.integers(0, 5_000_000)
demand_lists = st.lists(
    st.builds(
        lambda least, more, rank, weight: Demand(least, least + more, rank, weight),
        amounts,
        amounts,
        st.sampled_from([DRIVES, SEEN]),
        st.floats(0.01, 100.0),
    ),
    max_size=8,
).map(lambda demands: dict(enumerate(demands)))
budgets = st.floats(0, 50_000_000)


@given(budgets, demand_lists)
def test_together_they_get_no_more_than_there_is_and_each_no_more_than_it_can_use(
    budget_bps: float, demands: dict[int, Demand]
) -> None:
    parts = allocated(budget_bps, demands)
    assert parts.keys() == demands.keys()
    assert sum(parts.values()) <= budget_bps
    assert all(0 <= parts[stream] <= demands[stream].most_bps for stream in demands)


@given(budgets, demand_lists)
def test_nothing_is_left_while_somebody_can_use_it(budget_bps: float, demands: dict[int, Demand]) -> None:
    usable_bps = min(budget_bps, sum(one.most_bps for one in demands.values()))
    assert sum(allocated(budget_bps, demands).values()) == pytest.approx(usable_bps, abs=len(demands) + 1)


@given(budgets, demand_lists)
def test_everyone_has_its_least_if_there_is_enough_for_that(budget_bps: float, demands: dict[int, Demand]) -> None:
    if sum(one.least_bps for one in demands.values()) <= budget_bps:
        parts = allocated(budget_bps, demands)
        assert all(parts[stream] >= one.least_bps - 1 for stream, one in demands.items())


@given(budgets, st.floats(0, 5_000_000), demand_lists)
def test_of_more_nobody_gets_less(budget_bps: float, more_bps: float, demands: dict[int, Demand]) -> None:
    before, after = allocated(budget_bps, demands), allocated(budget_bps + more_bps, demands)
    assert all(after[stream] >= before[stream] - 1 for stream in demands)


def test_what_drives_is_served_before_what_is_seen() -> None:
    demands = {"drives": Demand(100, 1_000, DRIVES), "seen": Demand(100, 1_000, SEEN, weight=9.0)}
    assert allocated(50, demands) == {"drives": 50, "seen": 0}
    assert allocated(150, demands) == {"drives": 100, "seen": 50}
    assert allocated(600, demands) == {"drives": 500, "seen": 100}
    assert allocated(1_500, demands) == {"drives": 1_000, "seen": 500}
    assert allocated(9_000, demands) == {"drives": 1_000, "seen": 1_000}


def test_beyond_the_least_parts_are_as_the_weights_and_what_one_can_t_use_is_the_others() -> None:
    large, small = Demand(100, 10_000, weight=3.0), Demand(100, 10_000, weight=1.0)
    assert allocated(600, {"large": large, "small": small}) == {"large": 400, "small": 200}
    sated = Demand(100, 200, weight=3.0)
    assert allocated(600, {"sated": sated, "small": small}) == {"sated": 200, "small": 400}


def test_of_too_little_those_of_one_rank_get_equal_parts_of_their_least() -> None:
    assert allocated(150, {"a": Demand(100, 900), "b": Demand(200, 900)}) == {"a": 50, "b": 100}
