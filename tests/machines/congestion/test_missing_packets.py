"""A packet is missing when all its sendings are known to be lost, and told once."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.congestion.arrival_report import ArrivalReport
from mosaic_core.machines.congestion.missing_packets import MissingPackets


def reported(missing: MissingPackets, first: int, *arrivals: float | None) -> list[int]:
    return missing.reported(ArrivalReport(first, arrivals))


def test_what_did_not_arrive_is_missing_once() -> None:
    missing = MissingPackets()
    for number in range(4):
        missing.sent(number, 100 + number)
    assert reported(missing, 0, 1.0, None, 1.1, None) == [101, 103]
    assert reported(missing, 0, 1.0, None, 1.1, None) == []


def test_while_a_copy_is_on_its_way_there_is_hope() -> None:
    missing = MissingPackets()
    missing.sent(65_535, 7)
    missing.sent(0, 7)
    assert reported(missing, 65_535, None) == []
    assert reported(missing, 0, None) == [7]


def test_one_that_arrived_is_enough() -> None:
    missing = MissingPackets()
    missing.sent(1, 7)
    missing.sent(2, 7)
    assert reported(missing, 1, 1.0, None) == []


def test_a_repeat_that_is_lost_too_is_missing_again() -> None:
    missing = MissingPackets()
    missing.sent(1, 7)
    assert reported(missing, 1, None) == [7]
    missing.sent(2, 7)
    assert reported(missing, 2, None) == [7]


def test_numbers_of_other_streams_mean_nothing() -> None:
    assert reported(MissingPackets(), 1, None, 1.0) == []


def test_it_remembers_a_while_and_no_longer() -> None:
    missing = MissingPackets()
    for number in range(5000):
        missing.sent(number, number)
    assert reported(missing, 0, *[None] * 5000) == list(range(5000 - 2048, 5000))


@given(st.lists(st.tuples(st.integers(0, 20), st.booleans()), max_size=100))
def test_missing_is_what_never_arrived(sendings: list[tuple[int, bool]]) -> None:
    missing = MissingPackets()
    for number, (sequence_number, _) in enumerate(sendings):
        missing.sent(number, sequence_number)
    arrivals = [1.0 if has_arrived else None for _, has_arrived in sendings]
    arrived = {sequence_number for sequence_number, has_arrived in sendings if has_arrived}
    assert set(reported(missing, 0, *arrivals)) == {sequence_number for sequence_number, _ in sendings} - arrived
