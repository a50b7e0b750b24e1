"""The standing queue of a flow: found when it stands, not when it passes, whatever the path."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.congestion.standing_queue import MEMORY_S, TARGET_S, StandingQueue

RATE_BPS = 4e6
PACKET_BITS = 1200 * 8


def flow(seconds: float, *, base_s: float, queue: StandingQueue | None, rate_bps: float = RATE_BPS) -> list[float]:
    """A flow that grows by a packet per round trip, fluid model: the queue's delay in seconds, round by round."""
    window_bits, now_s, delays = 1.0 * PACKET_BITS, 0.0, []
    while now_s < seconds:
        trip_s = max(base_s, window_bits / rate_bps)
        delays.append(trip_s - base_s)
        share = queue.heard(trip_s, now_s, is_full=True) if queue else None
        now_s += trip_s
        window_bits = window_bits * share if share is not None else window_bits + PACKET_BITS
    return delays


@pytest.mark.parametrize("base_s", [0.005, 0.04, 0.2])
def test_the_queue_stays_near_the_target_where_it_would_grow_without_end(base_s: float) -> None:
    kept = flow(60, base_s=base_s, queue=StandingQueue())
    assert max(kept) <= TARGET_S + 5 * PACKET_BITS / RATE_BPS
    assert max(flow(60, base_s=base_s, queue=None)) > 5 * TARGET_S


@pytest.mark.parametrize("base_s", [0.005, 0.04, 0.2])
def test_the_link_is_hardly_ever_idle(base_s: float) -> None:
    delays = flow(120, base_s=base_s, queue=StandingQueue())
    grown = delays[next(number for number, delay_s in enumerate(delays) if delay_s > 0) :]
    assert sum(delay_s > 0 for delay_s in grown) > 0.9 * len(grown)


def test_one_late_answer_in_a_round_trip_is_no_queue() -> None:
    queue = StandingQueue()
    said = [queue.heard(1.0 if number % 5 == 3 else 0.02, number * 0.01, is_full=True) for number in range(200)]
    assert said == [None] * 200


def test_a_path_that_became_longer_is_believed_after_a_while() -> None:
    queue = StandingQueue()
    for number in range(100):
        queue.heard(0.02, number * 0.02, is_full=False)
    after = [queue.heard(0.2, 2 + number * 0.1, is_full=True) for number in range(1000)]
    assert any(share is not None for share in after[:20])
    assert not any(after[round(2 * MEMORY_S / 0.1) + 10 :])


@given(st.lists(st.tuples(st.floats(1e-4, 5), st.floats(0, 2), st.booleans()), max_size=200))
def test_a_window_only_ever_shrinks_and_never_to_nothing(samples: list[tuple[float, float, bool]]) -> None:
    queue, now_s = StandingQueue(), 0.0
    for trip_s, pause_s, is_full in samples:
        now_s += pause_s
        share = queue.heard(trip_s, now_s, is_full=is_full)
        assert share is None or 0 < share < 1


def test_a_window_that_was_not_full_makes_no_queue() -> None:
    queue = StandingQueue()
    said = [queue.heard(0.01 + number * 0.01, number * 0.1, is_full=False) for number in range(100)]
    assert said == [None] * 100
