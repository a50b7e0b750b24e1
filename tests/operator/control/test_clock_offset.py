"""Two clocks, four stamps: the offset is never wrong by more than half the shortest round trip."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.timing.clock_offset import ClockOffset

delays = st.integers(min_value=0, max_value=500_000)


@given(st.integers(-(10**12), 10**12), st.lists(st.tuples(delays, delays, delays), min_size=1, max_size=50))
def test_the_offset_is_right_within_half_the_best_round_trip(true_us: int, trips: list[tuple[int, int, int]]) -> None:
    clock = ClockOffset()
    now_us = 10**13
    for there_us, thinking_us, back_us in trips:
        t1 = now_us + there_us + true_us
        t2 = t1 + thinking_us
        t3 = t2 - true_us + back_us
        sample = clock.add(now_us, t1, t2, t3)
        assert sample is not None
        assert sample.round_trip_us == there_us + back_us == clock.round_trip_us
        now_us = t3 + 1000
    best = clock.best
    assert best is not None
    assert best.round_trip_us == min(there + back for there, _, back in trips[-20:])
    assert abs(best.offset_us - true_us) <= best.round_trip_us / 2 + 1
    theirs = clock.to_theirs_us(now_us)
    assert theirs is not None
    assert clock.to_ours_us(theirs) == now_us


def test_stamps_that_cannot_be_are_left_out() -> None:
    clock = ClockOffset()
    assert clock.add(100, 0, 0, 50) is None
    assert clock.add(0, 100, 50, 200) is None
    assert clock.add(0, 0, 500, 100) is None
    assert clock.best is None
    assert clock.round_trip_us is None
    assert clock.to_ours_us(1) is None
    assert clock.to_theirs_us(1) is None


def test_a_robot_that_started_anew_has_a_new_clock() -> None:
    clock = ClockOffset()
    clock.add(0, 10, 10, 20)
    clock.reset()
    assert clock.best is None


def test_a_short_round_trip_counts_only_as_long_as_it_is_in_the_window() -> None:
    """Clocks drift: the best sample of an hour ago says little about now."""
    clock = ClockOffset(window=3)
    clock.add(0, 5, 5, 10)
    for now_us in (1000, 2000):
        clock.add(now_us, now_us + 50, now_us + 50, now_us + 100)
    assert clock.best is not None
    assert clock.best.round_trip_us == 10
    clock.add(3000, 3050, 3050, 3100)
    assert clock.best.round_trip_us == 100
