"""Lines are cut where they end, wherever the stream is cut, and what never ends costs nothing."""

from __future__ import annotations

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from mosaic_sensors.lines import Lines

STREAMS = st.lists(st.sampled_from([b"a", b"bc", b"\r", b"\n", b"\r\n", b"xxxxxxxx"]), max_size=60).map(b"".join)


@given(STREAMS | st.binary(max_size=300), st.lists(st.integers(1, 300), max_size=10), st.sampled_from([4, 1024]))
def test_where_the_stream_is_cut_does_not_matter(data: bytes, cuts: list[int], max_bytes: int) -> None:
    whole, piecewise = Lines(max_bytes), Lines(max_bytes)
    edges = sorted({0, *(cut for cut in cuts if cut < len(data)), len(data)})

    found = [line for start, end in pairwise(edges) for line in piecewise.feed(data[start:end])]
    assert found == whole.feed(data)
    assert piecewise.too_long == whole.too_long
    assert all(len(line) <= max_bytes for line in found)


def test_blank_lines_are_left_out_and_a_rest_waits() -> None:
    lines = Lines()

    assert lines.feed(b"one\r\n\r\ntw") == [b"one"]
    assert lines.feed(b"o\n") == [b"two"]


def test_a_line_that_never_ends_is_thrown_away_to_its_end_and_counted_once() -> None:
    lines = Lines()
    for _ in range(100):
        assert lines.feed(b"x" * 500) == []

    assert lines.feed(b"its end\nnext\n") == [b"next"]
    assert lines.too_long == 1
