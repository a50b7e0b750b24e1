"""What is found of a leader arm and its follower."""

from __future__ import annotations

import math

import pytest
from arm_bench.figures import Sighting, first_sightings, followed, rank, table_line
from hypothesis import given
from hypothesis import strategies as st


def test_a_place_counts_from_its_first_reading_to_the_first_goal_as_far_or_further() -> None:
    led = [(0.0, 10), (0.01, 11), (0.02, 11), (0.03, 12), (0.04, 13)]
    told = [(0.02, 10), (0.05, 11), (0.06, 11), (0.09, 13)]
    found = followed(led, told)
    assert found.latencies_ms == pytest.approx([40, 60, 50])
    assert found.gaps_ms == pytest.approx([40])
    assert (found.missed, found.longest_gap_ms) == (0, pytest.approx(40))


def test_what_the_follower_never_reached_is_missed_and_no_latency() -> None:
    found = followed([(0.0, 10), (1.0, 11), (2.0, 12)], [(1.5, 11)])
    assert (found.latencies_ms, found.missed) == ([500.0], 1)
    assert math.isnan(found.longest_gap_ms)
    assert math.isnan(followed([(0.0, 10), (1.0, 11)], []).latency_ms(0.5))


@st.composite
def walks(draw: st.DrawFn) -> list[Sighting]:
    steps = draw(st.lists(st.tuples(st.floats(0.001, 0.1), st.integers(0, 3)), min_size=2, max_size=40))
    at_s, ticks, found = 0.0, 1000, []
    for step_s, further in steps:
        at_s, ticks = at_s + step_s, ticks + further
        found.append((at_s, ticks))
    return found


@given(walks(), st.floats(0.0, 1.0))
def test_of_a_follower_that_is_told_all_so_much_later_every_latency_is_that(led: list[Sighting], late_s: float) -> None:
    found = followed(led, [(at_s + late_s, ticks) for at_s, ticks in led])
    assert found.missed == 0
    assert found.latencies_ms == pytest.approx([1e3 * late_s] * (len(first_sightings(led)) - 1), abs=1e-6)


@given(walks(), st.sets(st.integers(0, 39)))
def test_commands_that_are_lost_make_nothing_younger(led: list[Sighting], lost: set[int]) -> None:
    whole = followed(led, led)
    found = followed(led, [one for index, one in enumerate(led) if index not in lost])
    assert len(found.latencies_ms) + found.missed == len(whole.latencies_ms)
    assert all(a >= b - 1e-9 for a, b in zip(found.latencies_ms, whole.latencies_ms, strict=False))


def test_ranks_are_values_and_a_line_of_the_table_has_them() -> None:
    assert (rank([3, 1, 2], 0.5), rank([3, 1, 2], 1.0)) == (2, 3)
    found = followed([(0.0, 10), (1.0, 11), (2.0, 12)], [(1.02, 11), (2.03, 12)])
    assert table_line("loopback", "ours", found) == "| loopback | ours | 20 / 30 / 30 | 1010 / 1010 |"
