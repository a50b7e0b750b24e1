"""One kind of work gets no more than its share of the loop's time, and no less when it wants it."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.timing.time_share import TimeShare

CREDIT_S = 0.001


def test_work_that_begins_need_not_wait() -> None:
    assert TimeShare(0.5, CREDIT_S).wait_s(5.0) == 0


def test_what_was_taken_is_paid_back_in_proportion() -> None:
    share = TimeShare(0.25, CREDIT_S)
    share.took(10.0, 10.01)
    assert share.wait_s(10.01) == pytest.approx(0.04 - 0.01 - CREDIT_S)
    assert share.wait_s(10.05) == 0


def test_idleness_earns_nothing() -> None:
    share = TimeShare(0.5, CREDIT_S)
    share.took(0.0, 0.1)
    share.took(100.0, 100.1)
    assert share.wait_s(100.1) == pytest.approx(0.1 - CREDIT_S)


@given(
    st.lists(st.floats(min_value=1e-5, max_value=2e-3), min_size=1, max_size=60), st.sampled_from([0.2, 0.4, 0.5, 0.9])
)
def test_greedy_work_gets_its_share_and_one_credit(lengths_s: list[float], part: float) -> None:
    share, now_s = TimeShare(part, CREDIT_S), 0.0
    for length_s in lengths_s:
        now_s += share.wait_s(now_s)
        share.took(now_s, now_s + length_s)
        now_s += length_s
    worked_s, longest_s = sum(lengths_s), max(lengths_s)
    slack_s = 1e-9
    assert worked_s <= part * now_s + longest_s + CREDIT_S + slack_s
    assert worked_s >= part * (now_s - CREDIT_S) - slack_s or now_s <= worked_s + slack_s
