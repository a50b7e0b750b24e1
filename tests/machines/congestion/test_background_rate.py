"""The bit rate of what gives way: back as soon as a queue begins, forward little by little, never nothing."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.congestion.background_rate import (
    BURST_BYTES,
    LEAST_BPS,
    MOST_BPS,
    SILENT_S,
    START_BPS,
    BackgroundRate,
)
from mosaic_core.machines.congestion.path_watch import PathSeen

REPORT_S = 0.06


class Transfer:
    """Sends all that it may between two reports."""

    def __init__(self) -> None:
        self.rate, self.now_s = BackgroundRate(), 100.0
        self.report()

    def report(self, queue_s: float = 0.0, usual_s: float = 0.0) -> bool:
        return self.rate.reported(PathSeen(queue_s, queue_s, self.now_s, 5, 0), usual_s, self.now_s)

    def send(self, seconds: float, most_bytes: float = float("inf")) -> int:
        """How many bytes may be sent in this time."""
        sent_bytes, ends_at_s = 0, self.now_s + seconds
        while self.now_s < ends_at_s and sent_bytes < most_bytes:
            wait_s = self.rate.wait_s(self.now_s)
            if wait_s == 0.0:
                size_bytes = round(self.rate.burst_bytes)
                self.rate.sent(size_bytes, self.now_s)
                sent_bytes += size_bytes
            self.now_s += max(1e-4, wait_s)
        self.now_s = ends_at_s
        return sent_bytes

    def hear(self, times: int, queue_s: float = 0.0, usual_s: float = 0.0, most_bytes: float = float("inf")) -> float:
        """The bit rate of the last report."""
        for _ in range(times):
            sent_bytes = self.send(REPORT_S, most_bytes)
            self.is_its_queue = self.report(queue_s, usual_s)
        return sent_bytes * 8 / REPORT_S

    def bps(self) -> float:
        return self.send(2 * SILENT_S / 3) * 8 / (2 * SILENT_S / 3)


def test_it_begins_at_a_rate_that_a_narrow_link_bears() -> None:
    assert Transfer().bps() == pytest.approx(START_BPS, rel=0.05)


def test_without_pictures_nothing_limits_it() -> None:
    rate = BackgroundRate()
    for _ in range(100):
        rate.sent(100_000, 5.0)
        assert rate.wait_s(5.0) == 0.0
    assert not rate.is_limited(5.0)


def test_once_nobody_tells_of_pictures_any_more_nothing_limits_it() -> None:
    transfer = Transfer()
    transfer.rate.sent(1_000_000, transfer.now_s)
    assert transfer.rate.wait_s(transfer.now_s + SILENT_S) > 0.0
    assert transfer.rate.wait_s(transfer.now_s + SILENT_S + 0.01) == 0.0


def test_what_was_sent_meanwhile_is_not_held_against_it_when_pictures_come_back() -> None:
    transfer = Transfer()
    transfer.hear(10, queue_s=0.05)
    transfer.now_s += SILENT_S + 1
    transfer.rate.sent(10_000_000, transfer.now_s)
    assert not transfer.report(queue_s=0.2)
    assert transfer.rate.wait_s(transfer.now_s) == 0.0
    assert transfer.bps() == pytest.approx(START_BPS, rel=0.05)


def test_as_long_as_reports_limit_it_the_next_one_goes_on_from_the_last() -> None:
    transfer = Transfer()
    transfer.hear(1, queue_s=0.15)
    transfer.now_s += SILENT_S
    assert transfer.rate.is_limited(transfer.now_s)
    transfer.report()
    assert transfer.bps() == pytest.approx(LEAST_BPS, rel=0.5)


def test_two_reports_of_one_moment_are_two_reports() -> None:
    transfer = Transfer()
    transfer.send(REPORT_S)
    transfer.report()
    assert not transfer.report(queue_s=0.05), "nothing was sent in between"
    assert transfer.bps() == pytest.approx(START_BPS, rel=0.15)


def test_where_there_is_room_it_grows_until_nothing_limits_it() -> None:
    transfer = Transfer()
    transfer.hear(17)
    assert not transfer.is_its_queue
    assert transfer.bps() == pytest.approx(4 * START_BPS, rel=0.2)
    transfer.hear(70)
    assert not transfer.rate.is_limited(transfer.now_s)
    assert transfer.rate.wait_s(transfer.now_s) == 0.0


def test_a_queue_limits_what_was_without_limit() -> None:
    transfer = Transfer()
    transfer.hear(120)
    sent_bps = transfer.hear(1, queue_s=0.05, most_bytes=75_000)
    assert transfer.is_its_queue
    assert transfer.bps() == pytest.approx(0.6 * sent_bps, rel=0.05)


def test_a_short_queue_makes_it_slower_step_by_step_and_it_answers_for_that_until_it_sends_next_to_nothing() -> None:
    transfer = Transfer()
    transfer.hear(1, queue_s=0.03)
    assert transfer.is_its_queue
    assert transfer.bps() == pytest.approx(0.6 * START_BPS, rel=0.1)
    transfer.report()
    transfer.hear(40, queue_s=0.03)
    for _ in range(20):
        transfer.hear(1, queue_s=0.03)
        assert not transfer.is_its_queue, "pictures have to give way too"
    assert transfer.bps() == pytest.approx(LEAST_BPS, rel=0.5)


def test_each_step_has_its_effect_before_the_next() -> None:
    transfer = Transfer()
    transfer.hear(2, queue_s=0.03)
    assert transfer.is_its_queue
    assert transfer.bps() == pytest.approx(0.6 * START_BPS, rel=0.1)


def test_beside_a_long_queue_it_sends_next_to_nothing_at_once() -> None:
    transfer = Transfer()
    transfer.hear(1, queue_s=0.15)
    assert transfer.bps() == pytest.approx(LEAST_BPS, rel=0.5)


def test_after_that_it_is_careful_for_some_seconds() -> None:
    transfer = Transfer()
    transfer.hear(1, queue_s=0.03)
    transfer.hear(34)
    assert transfer.bps() == pytest.approx(0.6 * START_BPS * 1.25**2, rel=0.15)


def test_what_is_usual_on_a_path_is_no_queue() -> None:
    transfer = Transfer()
    transfer.hear(17, queue_s=0.05, usual_s=0.045)
    assert transfer.bps() > 3 * START_BPS


def test_a_little_that_is_sent_proves_no_room() -> None:
    transfer = Transfer()
    transfer.hear(30, most_bytes=START_BPS / 8 * REPORT_S / 4)
    assert transfer.bps() == pytest.approx(START_BPS, rel=0.05)


def test_a_packet_at_a_time_is_sent_where_it_is_slow_and_5_ms_where_it_is_fast() -> None:
    transfer = Transfer()
    assert transfer.rate.burst_bytes == BURST_BYTES
    transfer.hear(50)
    burst_bytes = transfer.rate.burst_bytes
    assert burst_bytes == pytest.approx(START_BPS * 4 ** (50 * REPORT_S) / 8 * 0.005, rel=0.2)
    assert burst_bytes == pytest.approx(transfer.bps() / 8 * 0.005, rel=0.05)


def test_who_sends_nothing_answers_for_no_queue_and_proves_no_room() -> None:
    transfer = Transfer()
    transfer.hear(30, most_bytes=0)
    assert transfer.bps() == pytest.approx(START_BPS, rel=0.05)
    transfer.report()
    transfer.hear(1, queue_s=0.05, most_bytes=0)
    assert not transfer.is_its_queue


@given(st.lists(st.floats(0.0, 1.0), max_size=60))
def test_it_never_starves_and_never_bursts_more_than_5_ms(queues_s: list[float]) -> None:
    transfer = Transfer()
    for queue_s in queues_s:
        transfer.hear(1, queue_s=queue_s)
        assert transfer.rate.wait_s(transfer.now_s) <= BURST_BYTES * 8 / LEAST_BPS + 0.01
        assert transfer.rate.burst_bytes <= max(BURST_BYTES, 2 * MOST_BPS / 8 * 0.005)
