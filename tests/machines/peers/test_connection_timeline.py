"""The timeline of a set-up: each moment once, bounded, nothing private in its summary."""

from __future__ import annotations

import json

from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.peers.connection_timeline import MAX_DETAIL, ConnectionTimeline
from mosaic_core.words.timeline import MOMENT_TITLES, MOMENTS


def test_moments_are_told_by_time_with_their_details() -> None:
    it = ConnectionTimeline(100.0)
    it.mark("offered", 100.010, "2 media lines")
    it.mark("ice", 100.050, "host → host over UDP, 192.0.2.7:5000")
    assert [(one.moment, round(one.at_ms)) for one in it.marks] == [("offered", 10), ("ice", 50)]
    assert it.at_ms("ice") is not None
    assert it.at_ms("dtls") is None
    assert it.marks[1].detail.startswith("host → host")


def test_only_the_first_time_counts_and_nothing_after_the_end() -> None:
    it = ConnectionTimeline(0.0)
    it.mark("frame", 1.0)
    it.mark("frame", 2.0)
    it.end("peer.lost", 3.0)
    it.end("peer.closed", 4.0)
    it.mark("value", 5.0)
    assert it.wire()["marks"] == [{"moment": "frame", "title": "First picture", "atMs": 1000.0, "detail": ""}]
    assert (it.wire()["code"], it.wire()["endedMs"]) == ("peer.lost", 3000.0)


def test_the_summary_for_logs_has_no_addresses() -> None:
    it = ConnectionTimeline(0.0)
    assert it.summary() == "nothing ms"
    it.mark("ice", 0.04, "host 192.0.2.7:5000")
    it.end("dtls.timeout", 10.04)
    assert it.summary() == "ice 40; ended 10040 (dtls.timeout) ms"


def test_times_are_told_to_a_tenth_of_a_millisecond_and_none_lies_before_the_beginning() -> None:
    it = ConnectionTimeline(100.0)
    it.mark("asked", 99.0)
    it.mark("offered", 100.01234)
    it.end("peer.lost", 101.23456)
    told = it.wire()
    assert [one["atMs"] for one in told["marks"]] == [0.0, 12.3]
    assert told["endedMs"] == 1234.6


def test_moments_of_the_same_time_are_told_in_the_order_of_a_set_up() -> None:
    it = ConnectionTimeline(0.0)
    for moment in reversed(MOMENTS):
        it.mark(moment, 1.0)
    assert [one.moment for one in it.marks] == list(MOMENTS)


def test_what_lives_tells_no_end() -> None:
    assert ConnectionTimeline(0.0).wire() == {"marks": []}


def test_every_moment_has_a_title() -> None:
    assert set(MOMENT_TITLES) == set(MOMENTS)


@given(st.lists(st.tuples(st.sampled_from(MOMENTS), st.floats(0, 1e5), st.text(max_size=500)), max_size=200))
def test_it_stays_bounded_whatever_happens(told: list[tuple[str, float, str]]) -> None:
    it = ConnectionTimeline(0.0)
    for moment, at_s, detail in told:
        it.mark(moment, at_s, detail)  # type: ignore[arg-type]
    assert len(it.marks) == len({moment for moment, _, _ in told})
    assert all(len(one.detail) <= MAX_DETAIL for one in it.marks)
    assert [one.at_ms for one in it.marks] == sorted(one.at_ms for one in it.marks)
    json.dumps(it.wire())
