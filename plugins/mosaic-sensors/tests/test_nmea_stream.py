"""Lines are cut where they end, and a recording plays at its own pace."""

from __future__ import annotations

from datetime import time
from itertools import pairwise
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_sensors.nmea_stream import MAX_GAP_S, UNTIMED_EPOCH_S, Lines, Pace


@given(st.binary(max_size=300), st.lists(st.integers(1, 300), max_size=10))
def test_where_the_stream_is_cut_does_not_matter(data: bytes, cuts: list[int]) -> None:
    whole, piecewise = Lines(), Lines()
    edges = sorted({0, *(cut for cut in cuts if cut < len(data)), len(data)})

    found = [line for start, end in pairwise(edges) for line in piecewise.feed(data[start:end])]
    assert found == whole.feed(data)


def test_blank_lines_are_left_out_and_a_rest_waits() -> None:
    lines = Lines()

    assert lines.feed(b"one\r\n\r\ntw") == [b"one\r"]
    assert lines.feed(b"o\n") == [b"two"]


def test_a_line_without_an_end_is_thrown_away() -> None:
    lines = Lines()
    for _ in range(100):
        lines.feed(b"x" * 500)

    assert lines.feed(b"\nnext\n")[-1] == b"next"


def timed(hour: int, minute: int, second: int, microsecond: int = 0) -> SimpleNamespace:
    return SimpleNamespace(msgID="GGA", time=time(hour, minute, second, microsecond))


def test_the_pace_is_that_of_the_times_in_the_recording() -> None:
    pace = Pace()

    assert pace.wait_s(timed(10, 0, 0)) == 0
    assert pace.wait_s(timed(10, 0, 0)) == 0
    assert pace.wait_s(timed(10, 0, 0, 200_000)) == pytest.approx(0.2)
    assert pace.wait_s(None) == 0
    assert pace.wait_s(SimpleNamespace(msgID="GSA")) == 0


def test_midnight_is_no_gap_and_a_gap_is_not_waited_out() -> None:
    pace = Pace()
    pace.wait_s(timed(23, 59, 59))

    assert pace.wait_s(timed(0, 0, 0)) == pytest.approx(1.0)
    assert pace.wait_s(timed(12, 0, 0)) == MAX_GAP_S
    assert pace.wait_s(timed(11, 0, 0)) == MAX_GAP_S


def test_a_receiver_that_does_not_know_the_time_speaks_once_a_second() -> None:
    assert Pace().wait_s(SimpleNamespace(msgID="GGA", time="")) == UNTIMED_EPOCH_S
