"""What a receiver tells of each packet, and that the robot's reader understands what is written of it."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.congestion.arrival_log import MOST_ARRIVALS, MOST_NUMBERS, ArrivalLog
from mosaic_core.machines.congestion.arrival_report import NUMBERS, TICK_S, ArrivalReport, arrival_reports, written

MTU = 1200


def noted(*arrivals: tuple[int, float], log: ArrivalLog | None = None) -> list[ArrivalReport]:
    log = log or ArrivalLog()
    for number, at_s in arrivals:
        log.note(number % NUMBERS, at_s)
    return log.take()


def test_what_came_is_told_once_with_what_is_missing_between() -> None:
    log = ArrivalLog()
    assert noted((5, 1.0), (6, 1.125), (8, 1.5), log=log) == [ArrivalReport(5, (1.0, 1.125, None, 1.5))]
    assert log.take() == []
    assert noted((11, 2.0), log=log) == [ArrivalReport(9, (None, None, 2.0))]


def test_packets_that_overtake_each_other_are_told_in_the_order_of_their_numbers() -> None:
    assert noted((5, 1.0), (7, 1.25), (6, 1.5)) == [ArrivalReport(5, (1.0, 1.5, 1.25))]


def test_what_comes_after_it_was_told_to_be_missing_is_told_by_itself() -> None:
    log = ArrivalLog()
    noted((5, 1.0), (8, 1.25), log=log)
    assert noted((6, 1.5), (9, 1.75), log=log) == [ArrivalReport(6, (1.5,)), ArrivalReport(9, (1.75,))]


def test_of_two_packets_with_one_number_the_first_counts() -> None:
    assert noted((5, 1.0), (5, 2.0)) == [ArrivalReport(5, (1.0,))]


def test_numbers_begin_again_at_zero() -> None:
    log = ArrivalLog()
    assert noted((65_534, 1.0), (0, 1.25), log=log) == [ArrivalReport(65_534, (1.0, None, 1.25))]
    assert noted((65_535, 1.5), (1, 1.75), log=log) == [ArrivalReport(65_535, (1.5,)), ArrivalReport(1, (1.75,))]


def test_a_gap_in_which_nothing_can_be_waited_for_is_not_told() -> None:
    log = ArrivalLog()
    noted((0, 1.0), log=log)
    assert noted((MOST_NUMBERS, 2.0), log=log)[0].first_number == 1
    assert noted((2 * MOST_NUMBERS + 1, 3.0), log=log) == [ArrivalReport(2 * MOST_NUMBERS + 1, (3.0,))]


@pytest.mark.parametrize("later_s", [8.5, -8.5])
def test_arrivals_whose_difference_does_not_fit_are_told_in_two_reports(later_s: float) -> None:
    assert noted((1, 100.0), (3, 100.0 + later_s)) == [
        ArrivalReport(1, (100.0,)),
        ArrivalReport(2, (None, 100.0 + later_s)),
    ]


def test_many_are_told_in_reports_that_fit_into_a_datagram() -> None:
    reports = noted(*((2 * number, number % 2 + number / 64) for number in range(3 * MOST_ARRIVALS)))
    assert len(reports) == 3
    assert all(len(written(report, 1, 2, 3)) <= MTU for report in reports)


def test_the_worst_that_a_report_can_hold_fits_into_a_datagram() -> None:
    arrivals = [(8 * number, 8.0 * (number % 2)) for number in range(MOST_ARRIVALS)]
    assert max(len(written(report, 1, 2, 3)) for report in noted(*arrivals)) <= MTU


def test_a_report_names_both_streams_and_counts() -> None:
    rtcp = written(ArrivalReport(7, (0.321,)), 0x01020304, 0x05060708, 0x1FF)
    assert rtcp.hex(" ", 4) == "8fcd0005 01020304 05060708 00070001 000005ff a0000400"


@pytest.mark.parametrize("at_s", [0.0, 0.064 * (2**23 - 1), 0.064 * 2**24])
def test_a_clock_of_any_age_is_told_modulo_what_there_is_room_for(at_s: float) -> None:
    (report,) = arrival_reports(written(ArrivalReport(7, (at_s, at_s + 0.5)), 1, 2, 3))
    first_s, second_s = report.arrivals_s
    assert first_s is not None
    assert second_s is not None
    assert (first_s - at_s) % (0.064 * 2**24) == pytest.approx(0.0)
    assert second_s - first_s == pytest.approx(0.5)


arrival_times = st.lists(
    st.one_of(st.none(), st.integers(0, 300), st.integers(-2000, 40_000)), min_size=1, max_size=400
)


@given(st.integers(0, NUMBERS - 1), arrival_times, st.integers(0, 1 << 26), st.integers(1, 50))
def test_the_robot_reads_what_became_of_every_packet(
    first: int, steps: list[int | None], began: int, at_once: int
) -> None:
    log, at, told, came = ArrivalLog(), began, {}, {}
    for position in range(0, len(steps), at_once):
        for offset, step in enumerate(steps[position : position + at_once], position):
            if step is not None:
                at = max(0, at + step)
                came[(first + offset) % NUMBERS] = at
                log.note((first + offset) % NUMBERS, at * TICK_S)
        for report in log.take():
            rtcp = written(report, 1, 2, 3)
            assert len(rtcp) <= MTU
            (read,) = arrival_reports(rtcp)
            for number, at_s in enumerate(read.arrivals_s, read.first_number):
                assert number % NUMBERS not in told
                told[number % NUMBERS] = at_s
    assert {number: round(at_s / TICK_S) for number, at_s in told.items() if at_s is not None} == came
    wanted = [offset for offset, step in enumerate(steps) if step is not None]
    span = range(wanted[0], wanted[-1] + 1) if wanted else range(0)
    assert set(told) == {(first + offset) % NUMBERS for offset in span}


@given(st.permutations(range(40)), st.integers(0, NUMBERS - 1), st.integers(1, 40))
def test_in_whatever_order_they_come_each_packet_is_told_to_have_arrived(
    order: list[int], first: int, at_once: int
) -> None:
    log, told = ArrivalLog(), {}
    for position in range(0, len(order), at_once):
        for offset in order[position : position + at_once]:
            log.note((first + offset) % NUMBERS, offset / 1000)
        for report in log.take():
            for number, at_s in enumerate(report.arrivals_s, report.first_number):
                if at_s is not None:
                    assert number % NUMBERS not in told
                    told[number % NUMBERS] = at_s
    assert told == {(first + offset) % NUMBERS: pytest.approx(offset / 1000) for offset in order}


def test_a_report_holds_so_many_arrivals_and_numbers_and_no_more() -> None:
    full = noted(*((number, 1.0) for number in range(MOST_ARRIVALS + 1)))
    assert [len(one.arrivals_s) for one in full] == [MOST_ARRIVALS, 1]
    sparse = noted((0, 1.0), (MOST_NUMBERS - 1, 1.0), (MOST_NUMBERS, 1.0))
    assert [(one.first_number, len(one.arrivals_s)) for one in sparse] == [(0, MOST_NUMBERS), (MOST_NUMBERS, 1)]


@pytest.mark.parametrize(("ticks", "is_small"), [(255, True), (256, False), (-1, False), (0, True)])
def test_a_time_takes_one_byte_where_it_fits(ticks: int, is_small: bool) -> None:
    report = ArrivalReport(7, (64.0, 64.0 + ticks * TICK_S, None))
    rtcp = written(report, 1, 2, 3)
    assert len(rtcp) == (24 if is_small else 28), "whole words"
    assert int.from_bytes(rtcp[20:22], "big") >> 14 == (0b10 if is_small else 0b11)
    assert arrival_reports(rtcp) == [report]


def test_long_runs_are_one_chunk_each_and_of_any_length() -> None:
    for length in (14, 15, 8191):
        report = ArrivalReport(1, (64.0, *[None] * length, 64.5))
        assert arrival_reports(written(report, 1, 2, 3)) == ([report] if length < 8191 else [])
        assert len(written(report, 1, 2, 3)) < 40
