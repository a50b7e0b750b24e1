"""The queue on the way, what the path takes and what it loses, from when packets left and arrived."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.congestion.arrival_report import ArrivalReport
from mosaic_core.machines.congestion.path_watch import FASTEST_BPS, PathSeen, PathWatch

SIZE = 1000
AHEAD_S = 1234.5
"""The receiver's clock."""


class Path:
    """Packets of 1000 bytes leave and arrive as told; reported when asked."""

    def __init__(self) -> None:
        self.watch = PathWatch()
        self.number = 65_000
        self.arrivals: list[float | None] = []

    def send(self, sent_s: float, takes_s: float | None, *, size: int = SIZE) -> None:
        self.watch.sent((self.number + len(self.arrivals)) % 65_536, size, sent_s)
        self.arrivals.append(None if takes_s is None else sent_s + takes_s + AHEAD_S)

    def report(self, now_s: float) -> PathSeen | None:
        report = ArrivalReport(self.number, tuple(self.arrivals))
        self.number = (self.number + len(self.arrivals)) % 65_536
        self.arrivals = []
        return self.watch.reported(report, now_s)

    def seen(self, now_s: float) -> PathSeen:
        seen = self.report(now_s)
        assert seen is not None
        return seen

    def calm(self, until_s: float = 1.0) -> Path:
        for step in range(round(until_s * 100)):
            self.send(step / 100, 0.03)
            if step % 10 == 9:
                self.report(step / 100 + 0.05)
        return self

    def queue(self, from_s: float, count: int = 12) -> None:
        """A packet every 5 ms into a path that takes one every 10 ms: 0.8 Mbit/s."""
        for step in range(count):
            self.send(from_s + step * 0.005, 0.03 + step * 0.005)


def test_packets_that_take_as_long_as_ever_saw_no_queue() -> None:
    path = Path().calm()
    path.send(1.0, 0.03)
    seen = path.seen(1.1)
    assert seen.queue_s == pytest.approx(0.0, abs=1e-9)
    assert (seen.received, seen.lost, seen.path_bps) == (1, 0, None)


def test_the_queue_is_the_least_and_the_newest_wait_beyond_the_shortest_way() -> None:
    path = Path().calm()
    path.queue(1.0)
    seen = path.seen(1.2)
    assert seen.queue_s == pytest.approx(0.0, abs=1e-9)
    assert seen.newest_queue_s == pytest.approx(0.055)
    assert seen.newest_sent_s == pytest.approx(1.055)


def test_what_comes_through_while_a_queue_stands_is_what_the_path_takes() -> None:
    path = Path().calm()
    path.queue(1.0)
    assert path.seen(1.2).path_bps == pytest.approx(800_000, rel=0.01)


def test_it_tells_when_the_queue_will_have_drained() -> None:
    path = Path().calm()
    path.queue(1.0)
    path.watch.sent(60_000, 5 * SIZE, 1.06)  # not reported yet
    assert path.seen(1.08).empties_in_s == pytest.approx(1.055 + 0.055 + 0.05 - 1.08, abs=0.002)


def test_packets_that_come_all_at_once_after_a_gap_waited_for_a_processor() -> None:
    path = Path().calm()
    for step in range(12):
        path.send(1.0 + step * 0.01, 0.03 + 0.12 - step * 0.01)
    assert path.seen(1.2).path_bps is None


def test_a_longer_way_is_no_queue_for_ever() -> None:
    path, queues = Path().calm(), []
    for step in range(600):
        path.send(1.0 + step / 100, 0.1)
        if step % 10 == 9:
            queues.append(path.seen(1.05 + step / 100).queue_s)
    assert queues[0] == pytest.approx(0.07)
    assert queues[-1] == pytest.approx(0.0, abs=1e-9)


def test_packets_of_one_picture_tell_how_fast_the_path_is() -> None:
    path = Path()
    for picture in range(10):
        for packet in range(4):
            path.send(picture / 30, 0.03 + packet * 0.002)
    assert path.seen(0.4).trains_bps == pytest.approx(4_000_000, rel=0.01)


def beside_others(path: Path, *, longer_s: float, speed_s: float = 0.002, pictures: int = 8) -> PathSeen:
    """Pictures of four packets every 33 ms through a path of a packet per ``speed_s``; each waits longer than the one
    before."""
    for picture in range(pictures):
        for packet in range(4):
            path.send(1.0 + picture / 30, 0.06 + picture * longer_s + packet * speed_s)
    return path.seen(1.4)


def test_where_others_share_the_path_what_they_leave_is_told_by_a_queue_that_stands() -> None:
    seen = beside_others(Path().calm(), longer_s=0.0)
    assert seen.path_bps == pytest.approx(1_000_000, rel=0.1)
    assert seen.trains_bps == pytest.approx(4_000_000, rel=0.01)
    assert seen.left == pytest.approx(0.25, rel=0.1)


def test_what_a_queue_grows_by_is_not_left_by_others_and_what_it_shrinks_by_is() -> None:
    assert beside_others(Path().calm(), longer_s=0.0).left == pytest.approx(0.24, abs=0.01)
    assert beside_others(Path().calm(), longer_s=0.001).left == pytest.approx(0.21, abs=0.01)
    assert beside_others(Path().calm(), longer_s=-0.001).left == pytest.approx(0.27, abs=0.01)


def test_others_make_way_too_so_not_all_that_a_queue_grows_by_is_taken_from_us() -> None:
    seen = beside_others(Path().calm(), longer_s=0.03)
    assert seen.path_bps is not None
    assert seen.left == pytest.approx(0.75 * seen.path_bps / 4_000_000, rel=0.01)


def test_a_path_that_is_full_of_our_own_packets_is_all_ours() -> None:
    seen = beside_others(Path().calm(), longer_s=0.0, speed_s=1 / 120)
    assert seen.left == pytest.approx(1.0, abs=0.05)


def test_without_a_queue_or_trains_nobody_knows_what_others_leave() -> None:
    path = Path().calm()
    path.queue(1.0)
    seen = path.seen(1.2)
    assert seen.path_bps is not None
    assert seen.left is None
    assert Path().calm().report(1.0) is None


def test_a_path_without_a_bottleneck_is_fast_but_not_infinitely() -> None:
    path = Path()
    for picture in range(10):
        for _ in range(4):
            path.send(picture / 30, 0.03)
    assert path.seen(0.4).trains_bps == FASTEST_BPS


def test_each_packet_counts_once_and_those_of_other_streams_never() -> None:
    path = Path()
    path.send(0.0, 0.03)
    path.send(0.01, None)
    path.arrivals.append(AHEAD_S)  # another stream's
    number, arrivals = path.number, list(path.arrivals)
    assert (path.seen(0.1).received, path.report(0.1)) == (1, None)
    path.number, path.arrivals = number, arrivals
    assert path.report(0.2) is None


def test_what_is_reported_as_missing_is_lost() -> None:
    path = Path()
    for step in range(10):
        path.send(step / 100, None if step in (3, 4) else 0.03)
    assert (path.seen(0.2).received, path.number) == (8, 65_010)


def test_a_receiver_that_starts_its_clock_anew_is_judged_anew() -> None:
    path = Path().calm()
    path.send(1.0, 0.03 + 5000)
    assert path.seen(1.1).queue_s == pytest.approx(0.0, abs=1e-6)


@given(st.lists(st.tuples(st.floats(0, 0.05), st.one_of(st.none(), st.floats(0.01, 2))), min_size=1, max_size=60))
def test_whatever_arrives_the_figures_make_sense(packets: list[tuple[float, float | None]]) -> None:
    path, now_s = Path(), 0.0
    for pause_s, takes_s in packets:
        now_s += pause_s
        path.send(now_s, takes_s)
    seen = path.report(now_s + 2)
    if seen is not None:
        assert 0.0 <= seen.queue_s <= seen.newest_queue_s + 2
        assert seen.received + seen.lost == len(packets)
        assert seen.empties_in_s >= 0.0
        assert seen.path_bps is None or 0.0 < seen.path_bps <= FASTEST_BPS
        assert seen.left is None or 0.0 < seen.left <= 1.0
