"""Lost packets are repeated, but never so many that they are the congestion."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.congestion.retransmissions import SHARE, Retransmissions

BUDGET_BPS = 1_000_000


def test_a_lost_packet_is_sent_again() -> None:
    assert Retransmissions().may(7, BUDGET_BPS, 0.04, 1.0)


def test_asking_again_before_it_can_have_arrived_is_in_vain() -> None:
    repeats = Retransmissions()
    granted = [repeats.may(7, BUDGET_BPS, 0.16, 1.0 + step * 0.01) for step in range(25)]
    assert [step for step, was_granted in enumerate(granted) if was_granted] == [0, 10, 20]
    assert not repeats.is_exhausted


def test_beyond_the_share_a_packet_is_given_up_for_good() -> None:
    repeats = Retransmissions()
    granted = [repeats.may(number, BUDGET_BPS, 0.04, 1.0) for number in range(100)]
    assert 3 <= granted.count(True) <= 10
    assert granted[:3] == [True] * 3
    assert repeats.is_exhausted
    assert repeats.may(100, BUDGET_BPS, 0.04, 3.0)
    assert not repeats.is_exhausted


@given(
    st.lists(st.tuples(st.integers(0, 0xFFFF), st.floats(0, 0.05)), max_size=300),
    st.integers(100_000, 5_000_000),
    st.none() | st.floats(0, 1),
)
def test_over_any_time_repeats_take_their_share_and_no_more(
    asked: list[tuple[int, float]], budget_bps: int, round_trip_s: float | None
) -> None:
    repeats, now_s, granted = Retransmissions(), 0.0, 0
    for sequence_number, passed_s in asked:
        now_s += passed_s
        granted += repeats.may(sequence_number, budget_bps, round_trip_s, now_s)
    allowed_bytes = budget_bps * SHARE / 8 * (now_s + 0.15) + 4 * 1400
    assert granted * 1400 <= allowed_bytes + 1
