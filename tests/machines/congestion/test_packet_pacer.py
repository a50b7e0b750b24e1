"""Large pictures are spread: fewer are lost in short queues, and ordinary ones are not delayed."""

from __future__ import annotations

import random
import statistics

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.congestion.packet_pacer import BURST_S, LONGEST_WAIT_S, MIN_BURST_BYTES, PacketPacer
from mosaic_core.machines.laboratory.impaired_link import ImpairedLink, LinkProfile

BUDGET_BPS = 2_700_000
PACKET_BYTES = 1260
SENDING_S = 80e-6
"""What one packet costs the sender's event loop."""


def sent_over(link: ImpairedLink, *, is_paced: bool) -> tuple[int, float]:
    """30 s of pictures at the budget, every 90th a key frame three times as large: ``(pictures lost, median ms)``."""
    pacer, sizes = PacketPacer(), random.Random(1)
    now_s, lost, took_ms = 0.0, 0, []
    for number in range(900):
        mean_bytes = BUDGET_BPS / 8 / 30
        size_bytes = mean_bytes * (3 if number % 90 == 0 else sizes.uniform(0.5, 1.5))
        began_s = number / 30
        now_s = max(now_s, began_s)
        arrivals = []
        for _ in range(round(size_bytes / 1200) + 1):
            arrivals.append(link.arrival_s(PACKET_BYTES, now_s, 1.0, 0.0, 0.5))
            now_s += SENDING_S
            if is_paced:
                now_s += pacer.wait_s(PACKET_BYTES, BUDGET_BPS, now_s)
        arrived = [arrival_s for arrival_s in arrivals if arrival_s is not None]
        lost += len(arrived) < len(arrivals)
        took_ms.append((max(arrived) - began_s) * 1000)
    return lost, statistics.median(took_ms)


@pytest.mark.parametrize(("rate_mbps", "queue_ms"), [(8, 25), (20, 10)])
def test_in_short_queues_fewer_pictures_are_lost_and_the_ordinary_one_is_as_quick(
    rate_mbps: float, queue_ms: float
) -> None:
    profile = LinkProfile("short queue", rate_mbps=rate_mbps, queue_ms=queue_ms)
    lost, median_ms = sent_over(ImpairedLink(profile), is_paced=False)
    lost_paced, median_paced_ms = sent_over(ImpairedLink(profile), is_paced=True)
    assert lost >= 10
    assert lost_paced <= lost / 2
    assert median_paced_ms <= median_ms * 1.1


def test_what_is_within_the_burst_leaves_at_once() -> None:
    pacer = PacketPacer()
    assert [pacer.wait_s(1200, 100_000, 1.0) for _ in range(MIN_BURST_BYTES // 1200)] == [0.0] * 5


@given(st.lists(st.tuples(st.integers(1, 1500), st.floats(0, 0.05)), max_size=200), st.integers(100_000, 20_000_000))
def test_no_pause_is_long_and_over_time_it_is_no_slower_than_the_bit_rate(
    packets: list[tuple[int, float]], budget_bps: int
) -> None:
    pacer, now_s, paused_s, total = PacketPacer(), 0.0, 0.0, 0
    for size_bytes, passed_s in packets:
        now_s += passed_s
        pause_s = pacer.wait_s(size_bytes, budget_bps, now_s)
        assert 0.0 <= pause_s <= LONGEST_WAIT_S
        now_s += pause_s
        paused_s += pause_s
        total += size_bytes
    assert paused_s <= total * 8 / budget_bps + BURST_S


def paced(count: int, *, budget_bps: int, path_bps: float | None = None, waiting: int = 0) -> list[float]:
    """The pauses after so many packets of a kilobyte that leave in one moment."""
    pacer = PacketPacer()
    return [pacer.wait_s(1000, budget_bps, 1.0, path_bps, waiting) for _ in range(count)]


def test_on_a_known_path_packets_leave_as_fast_as_it_takes_them_after_a_short_burst() -> None:
    pauses = paced(8, budget_bps=1_000_000, path_bps=4_000_000)
    assert pauses[:6] == [0.0] * 6
    assert pauses[6:] == [pytest.approx(0.5e3 / 0.5e6), pytest.approx(1.5e3 / 0.5e6)]


def test_on_a_slow_path_three_packets_go_first_and_the_rest_is_a_little_faster_than_it_is_made() -> None:
    pauses = paced(4, budget_bps=400_000, path_bps=100_000)
    assert pauses == [0.0, 0.0, 0.0, pytest.approx(0.1e3 / 75e3)]


def test_of_a_fast_unknown_path_fifty_milliseconds_of_the_bit_rate_leave_at_once() -> None:
    pauses = paced(40, budget_bps=4_000_000)
    assert pauses[:25] == [0.0] * 25
    assert next(pause for pause in pauses if pause) == pytest.approx(2e3 / 2e6)


def test_pictures_behind_hurry_it_up() -> None:
    [*_, slow] = paced(9, budget_bps=400_000)
    [*_, quick] = paced(9, budget_bps=400_000, waiting=1)
    assert slow == pytest.approx(2.5e3 / 0.375e6)
    assert quick == pytest.approx(slow / 2)


def test_what_was_sent_is_paid_off_with_time_and_a_clock_that_goes_back_pays_nothing() -> None:
    pacer = PacketPacer()
    for _ in range(9):
        before = pacer.wait_s(1000, 400_000, 1.0)
    assert pacer.wait_s(0, 400_000, 0.5) == pytest.approx(before)
    assert pacer.wait_s(0, 400_000, 0.504) == pytest.approx(before - 0.004)
    assert pacer.wait_s(6500, 400_000, 9.0) == 0.0
