"""The speed of a path from a bounded amount of data, whatever the path is like."""

from __future__ import annotations

from dataclasses import dataclass

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mosaic_core.machines.diagnosis.path_trial import (
    FIRST_BYTES,
    MOST_UNDER_WAY_BYTES,
    PIECE_BYTES,
    QUEUE_S,
    TOTAL_BYTES,
    TRIAL_S,
    PathTrial,
)

TICK_S = 0.005


@dataclass
class Ran:
    trial: PathTrial
    took_s: float
    longest_queue_s: float


def ran(path_bps: float, round_trip_s: float) -> Ran:
    """Over a path of this rate, with a queue that loses nothing."""
    trial, now_s, free_at_s, longest_s = PathTrial(0.0), 0.0, 0.0, 0.0
    arrivals: list[float] = []
    while not trial.is_over(now_s):
        while trial.has_room(now_s):
            trial.sent_bytes += PIECE_BYTES
            free_at_s = max(free_at_s, now_s) + PIECE_BYTES * 8 / path_bps
            longest_s = max(longest_s, free_at_s - now_s)
            arrivals.append(free_at_s + round_trip_s)
        assert trial.sent_bytes - trial.arrived_bytes <= MOST_UNDER_WAY_BYTES
        now_s += TICK_S
        trial.arrived(PIECE_BYTES * sum(at_s <= now_s for at_s in arrivals), now_s)
    return Ran(trial, now_s, longest_s)


@pytest.mark.parametrize("path_bps", [200e3, 1e6, 5e6, 30e6])
@pytest.mark.parametrize("round_trip_s", [0.005, 0.05])
def test_the_rate_of_the_path_is_found(path_bps: float, round_trip_s: float) -> None:
    done = ran(path_bps, round_trip_s)
    assert done.trial.throughput_bps() == pytest.approx(path_bps, rel=0.35)
    assert not done.trial.is_least(round_trip_s) or path_bps == 30e6


@settings(max_examples=60, deadline=None)
@given(st.floats(80e3, 1e9), st.floats(0.0005, 0.8))
def test_it_ends_in_time_sends_little_and_leaves_room_for_pings(path_bps: float, round_trip_s: float) -> None:
    done = ran(path_bps, round_trip_s)
    assert done.took_s <= TRIAL_S + 2 * TICK_S
    assert done.trial.sent_bytes <= TOTAL_BYTES
    first_s = FIRST_BYTES * 8 / path_bps
    assert done.longest_queue_s <= max(first_s, 2 * QUEUE_S) + PIECE_BYTES * 8 / path_bps


def test_a_long_round_trip_is_no_slow_path() -> None:
    done = ran(100e6, 0.4)
    assert done.trial.throughput_bps() < 20e6
    assert done.trial.is_least(0.4), "it may take more: nobody shall be told to look for what is slow"


def test_a_slow_path_with_a_short_round_trip_is_one() -> None:
    assert not ran(500e3, 0.03).trial.is_least(0.03)


def test_where_nothing_arrives_it_ends_all_the_same() -> None:
    trial = PathTrial(0.0)
    assert trial.has_room(0.0)
    trial.sent_bytes = FIRST_BYTES
    assert not trial.has_room(0.5)
    assert not trial.is_over(0.5)
    assert trial.is_over(TRIAL_S)
    assert trial.throughput_bps() == 0


def test_what_shrinks_is_not_believed() -> None:
    trial = PathTrial(0.0)
    trial.arrived(8000, 0.1)
    trial.arrived(4000, 0.2)
    assert trial.arrived_bytes == 8000


def test_it_lasts_so_long_from_its_own_beginning_whatever_the_clock_shows() -> None:
    trial = PathTrial(100.0)
    assert not trial.is_over(100.0 + TRIAL_S - 0.001)
    assert trial.is_over(100.0 + TRIAL_S + 0.001)
