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


def test_at_any_bit_rate_four_packets_may_be_repeated_at_once_and_of_a_large_one_its_burst() -> None:
    for budget_bps, at_once in ((50_000, 4), (4_000_000, 16)):
        repeats = Retransmissions()
        assert [repeats.may(number, budget_bps, 0.04, 1.0) for number in range(30)].count(True) == at_once


def test_the_share_is_earned_with_time() -> None:
    repeats, rate_bytes = Retransmissions(), BUDGET_BPS * SHARE / 8
    while repeats.may(0, BUDGET_BPS, 0.0, 1.0) or repeats.may(1, BUDGET_BPS, 0.0, 1.0):
        pass
    for number in range(2, 9):
        repeats.may(number, BUDGET_BPS, 0.0, 1.0)
    assert not repeats.may(10, BUDGET_BPS, 0.0, 1.0)
    assert not repeats.may(10, BUDGET_BPS, 0.0, 0.5), "a clock that goes back earns nothing"
    assert repeats.may(10, BUDGET_BPS, 0.0, 0.5 + 1400 / rate_bytes)


def test_who_asks_for_a_packet_of_which_a_copy_was_sent_unasked_waits_for_that() -> None:
    repeats = Retransmissions()
    repeats.note(7, 1.0)
    assert not repeats.may(7, BUDGET_BPS, 0.1, 1.05)
    assert repeats.may(7, BUDGET_BPS, 0.1, 1.06)


def test_without_a_known_round_trip_it_is_taken_for_a_tenth_of_a_second_and_a_short_one_for_twenty_milliseconds() -> (
    None
):
    for round_trip_s, least_s in ((None, 0.06), (0.001, 0.02), (0.0, 0.02)):
        repeats = Retransmissions()
        assert repeats.may(7, BUDGET_BPS, round_trip_s, 0.0)
        assert not repeats.may(7, BUDGET_BPS, round_trip_s, least_s - 0.001)
        assert repeats.may(7, BUDGET_BPS, round_trip_s, least_s)


def test_of_the_packets_that_were_repeated_the_newest_are_remembered() -> None:
    repeats = Retransmissions()
    for number in range(256):
        repeats.note(number, 1.0)
    repeats.note(0, 1.0)  # once more: it is the newest now
    repeats.note(256, 1.0)
    asked = {number: repeats.may(number, BUDGET_BPS, 0.1, 1.01) for number in (0, 2, 256, 1)}
    assert asked == {0: False, 2: False, 256: False, 1: True}
