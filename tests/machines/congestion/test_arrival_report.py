"""What browsers report about single packets, read from bytes."""

from __future__ import annotations

from struct import pack

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.congestion.arrival_report import ArrivalReport, arrival_reports

TICKS_PER_S = 4000


def written(first: int, arrivals: list[int | None], *, reference: int = 5) -> bytes:
    """As receivers write it: two-bit symbols, seven to a chunk; times in quarters of a millisecond."""
    symbols, deltas, before = [], b"", reference * 256
    for ticks in arrivals:
        if ticks is None:
            symbols.append(0)
            continue
        delta, before = ticks - before, ticks
        is_small = 0 <= delta < 256
        symbols.append(1 if is_small else 2)
        deltas += pack("!B", delta) if is_small else pack("!h", delta)
    chunks = b""
    for start in range(0, len(symbols), 7):
        seven = (symbols[start : start + 7] + [0] * 7)[:7]
        chunks += pack("!H", 0xC000 | sum(symbol << 12 - 2 * place for place, symbol in enumerate(seven)))
    body = pack("!LLHH", 1, 2, first, len(arrivals)) + reference.to_bytes(3, "big") + b"\0" + chunks + deltas
    body += bytes(-len(body) % 4)
    return pack("!BBH", 0x8F, 205, len(body) // 4) + body


def test_each_packet_has_its_time_or_none() -> None:
    (report,) = arrival_reports(written(65_535, [1284, None, 1288, 1200, 5000]))
    assert report == ArrivalReport(65_535, (0.321, None, 0.322, 0.3, 1.25))


def test_runs_and_single_bits_are_read_too() -> None:
    head = pack("!LLHH", 1, 2, 10, 22) + (1).to_bytes(3, "big") + b"\0"
    chunks = pack("!HH", 0x2000 | 8, 0x8000 | 0b10_0000_0000_0001)  # eight that arrived; the first and last of fourteen
    body = head + chunks + bytes([4] * 10)
    body += bytes(-len(body) % 4)
    (report,) = arrival_reports(pack("!BBH", 0x8F, 205, len(body) // 4) + body)
    assert report.first_number == 10
    assert [at_s is not None for at_s in report.arrivals_s] == [True] * 9 + [False] * 12 + [True]
    assert report.arrivals_s[8] == pytest.approx(0.064 + 0.009)


def test_other_messages_are_passed_over() -> None:
    receiver_report = pack("!BBHL", 0x80, 201, 1, 1)
    nack = pack("!BBHLLHH", 0x81, 205, 3, 1, 2, 7, 0)
    reports = arrival_reports(receiver_report + nack + written(3, [1290]) + receiver_report + written(4, [1300]))
    assert [report.first_number for report in reports] == [3, 4]


@pytest.mark.parametrize("size", range(1, 26))
def test_a_report_that_ends_too_soon_is_left_out(size: int) -> None:
    assert arrival_reports(written(3, [1290, 1291, 9000])[:size]) == []


def test_a_run_of_nothing_does_not_run_for_ever() -> None:
    body = pack("!LLHH", 1, 2, 10, 22) + bytes(4) + bytes(4)
    assert arrival_reports(pack("!BBH", 0x8F, 205, len(body) // 4) + body) == []


@given(st.binary(max_size=200))
def test_no_bytes_of_the_network_raise(data: bytes) -> None:
    arrival_reports(data)
    arrival_reports(b"\x8f\xcd\x00\x20" + data)


@given(st.integers(0, 65_535), st.lists(st.one_of(st.none(), st.integers(1280, 30_000)), min_size=1, max_size=100))
def test_what_is_written_is_read(first: int, ticks: list[int | None]) -> None:
    (report,) = arrival_reports(written(first, ticks))
    assert report.first_number == first
    assert report.arrivals_s == tuple(None if one is None else pytest.approx(one / TICKS_PER_S) for one in ticks)


@pytest.mark.parametrize(("reference", "at_s"), [(0x7FFFFF, 536_870.848), (0x800000, -536_870.912), (0xFFFFFF, -0.064)])
def test_a_receivers_clock_may_stand_before_zero(reference: int, at_s: float) -> None:
    (report,) = arrival_reports(written(1, [reference * 256 + 4], reference=reference))
    assert report.arrivals_s == (pytest.approx(at_s + 0.001, abs=1e-6),)
