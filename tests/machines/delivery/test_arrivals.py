"""Missed and late, from the numbers alone."""

from __future__ import annotations

import json
import random
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.delivery.arrivals import ArrivalCounters, Arrivals
from mosaic_core.machines.delivery.framing import SEQ_MODULUS


def of(*seqs: int, newest_only: bool = False) -> tuple[list[bool], int, int]:
    counters = ArrivalCounters()
    arrivals = Arrivals(counters, newest_only=newest_only)
    return [arrivals.take(seq) for seq in seqs], counters.missed, counters.late


GOLDEN = json.loads((Path(__file__).parents[2] / "wire" / "arrivals.json").read_text())["cases"]


@pytest.mark.parametrize("case", [pytest.param(case, id=case["name"]) for case in GOLDEN])
def test_the_golden_cases_are_counted_as_written(case: dict[str, Any]) -> None:
    assert of(*case["seqs"], newest_only=case["newest_only"]) == (case["wanted"], case["missed"], case["late"])


def test_a_skipped_number_is_missed() -> None:
    assert of(1, 2, 5) == ([True, True, True], 2, 0)


def test_a_late_one_was_not_missed_and_is_worthless_where_only_the_newest_counts() -> None:
    assert of(1, 3, 2) == ([True, True, True], 0, 1)
    assert of(1, 3, 2, newest_only=True) == ([True, True, False], 0, 1)


def test_whoever_joins_late_has_missed_nothing() -> None:
    assert of(1000) == ([True], 0, 0)
    assert of(1000, 999, 1001) == ([True, True, True], 0, 1)


def test_what_comes_twice_is_late_and_takes_no_missed_one_away() -> None:
    assert of(1, 3, 3) == ([True, True, True], 1, 1)


def test_numbers_wrap() -> None:
    assert of(SEQ_MODULUS - 1, 1) == ([True, True], 1, 0)


@given(st.integers(1, 60), st.sets(st.integers(0, 59)), st.integers(0, SEQ_MODULUS - 1), st.randoms())
def test_in_any_order_missed_is_what_never_came_and_the_newest_is_always_handed_on(
    count: int, lost: set[int], start: int, shuffle: random.Random
) -> None:
    rest = [number for number in range(1, count) if number not in lost]
    shuffle.shuffle(rest)
    order = [0, *rest]
    taken, missed, late = of(*((start + number) % SEQ_MODULUS for number in order), newest_only=True)
    handed = [number for number, is_wanted in zip(order, taken, strict=True) if is_wanted]
    assert handed == sorted(handed)
    assert handed[-1] == max(order)
    assert missed == max(order) + 1 - len(order)
    assert late == len(order) - len(handed)
