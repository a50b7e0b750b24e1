"""Copies cover loss beside what the path takes, and give way as soon as it takes no more."""

from __future__ import annotations

import copy

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.congestion.packet_copies import RESERVE, PacketCopies

PACKETS, REPORT_S, SPARE_BPS = 20, 0.1, 2_000_000.0


def lossy(share: float, seconds: float = 5.0) -> PacketCopies:
    copies, lost, steps = PacketCopies(), 0.0, round(seconds / REPORT_S)
    for step in range(steps):
        lost += PACKETS * share
        copies.reported(int(lost), PACKETS - int(lost), step * REPORT_S, is_queued=False)
        lost -= int(lost)
    return copies


def copied(copies: PacketCopies, from_s: float, count: int = 100, spare_bps: float = SPARE_BPS) -> int:
    """Of so many packets of 1 kB in a second."""
    return sum(copies.wants(1000, spare_bps, from_s + step / count) for step in range(count))


def test_without_loss_nothing_is_sent_twice() -> None:
    copies = lossy(0.0)
    assert copied(copies, 5.0) == 0
    assert not copies.doubles_repeats


def test_one_packet_now_and_then_is_not_worth_it() -> None:
    assert copied(lossy(0.001), 5.0) == 0


def test_on_a_lossy_path_with_room_nearly_every_packet_is_sent_twice() -> None:
    copies = lossy(0.03)
    assert copied(copies, 5.0) >= 95
    assert copies.doubles_repeats


def test_never_more_than_the_path_has_to_spare() -> None:
    assert copied(lossy(0.03), 5.0, spare_bps=80_000) <= 14
    assert copied(lossy(0.03), 5.0, spare_bps=-1.0) == 0


def test_what_is_spared_may_be_spent_at_once_from_the_first_packet_on() -> None:
    copies = PacketCopies()
    copies.reported(50, 950, 1.0, is_queued=False)
    copies.wants(1, 0.0, 1.0)
    assert copies.wants(1000, SPARE_BPS, 1.0 + 1000 / (0.2 * SPARE_BPS / 8))
    assert not copies.wants(1, SPARE_BPS, 1.02)


def test_a_queue_ends_it_for_a_while_and_longer_each_time() -> None:
    copies, now_s, pauses = lossy(0.03), 5.0, []
    for _ in range(3):
        copies.reported(1, 19, now_s, is_queued=True)
        assert copied(copies, now_s) == 0
        began_s = now_s
        while not copied(copies, now_s, count=20):
            now_s += 1.0
            copies.reported(1, 19, now_s, is_queued=False)
        pauses.append(now_s - began_s)
    assert pauses == sorted(pauses)
    assert pauses[0] >= 5.0
    assert pauses[-1] >= 15.0


def test_a_queue_long_after_they_began_makes_no_pause_longer() -> None:
    copies, now_s = PacketCopies(), 0.0
    for _ in range(4):
        for _ in range(400):
            now_s += REPORT_S
            copies.reported(1, 19, now_s, is_queued=False)
        assert copied(copies, now_s)
        copies.reported(1, 19, now_s, is_queued=True)
        assert not copied(copies, now_s)
    for _ in range(60):
        now_s += REPORT_S
        copies.reported(1, 19, now_s, is_queued=False)
    assert copied(copies, now_s)


def test_when_nothing_gets_lost_any_more_it_ends() -> None:
    copies = lossy(0.03)
    for step in range(60):
        copies.reported(0, PACKETS, 5.0 + step * REPORT_S, is_queued=False)
    assert copied(copies, 11.0) == 0


def test_a_full_and_lossy_path_gives_some_of_the_pictures_bits_to_copies() -> None:
    assert lossy(0.03).picture_bps(1_000_000, is_limited=True) == round(1_000_000 * (1 - RESERVE))
    assert lossy(0.03).picture_bps(1_000_000, is_limited=False) == 1_000_000
    assert lossy(0.0).picture_bps(1_000_000, is_limited=True) == 1_000_000


@given(st.lists(st.tuples(st.integers(0, 50), st.integers(0, 50), st.booleans()), max_size=50), st.floats(0, 1e7))
def test_over_any_second_copies_take_their_share_and_a_burst_at_most(
    reports: list[tuple[int, int, bool]], spare_bps: float
) -> None:
    copies = PacketCopies()
    for step, (lost, received, is_queued) in enumerate(reports):
        copies.reported(lost, received, step * REPORT_S, is_queued=is_queued)
        assert 0.0 <= copies.loss <= 1.0
    assert copied(copies, 100.0, spare_bps=spare_bps) * 8000 <= 1.3 * spare_bps + 8000


def told(copies: PacketCopies, lost: int, received: int, now_s: float, *, is_queued: bool = False) -> bool:
    """Whether packets are sent twice after this report."""
    copies.reported(lost, received, now_s, is_queued=is_queued)
    copies.wants(1, 0.0, now_s)
    return copies.wants(1000, SPARE_BPS, now_s + 0.25)


@pytest.mark.parametrize(("lost", "is_copied"), [(4, False), (5, True), (150, True), (151, False)])
def test_copies_begin_at_half_a_percent_of_loss_and_end_where_too_much_is_sent(lost: int, is_copied: bool) -> None:
    assert told(PacketCopies(), lost, 1000 - lost, 1.0) is is_copied


def test_once_begun_they_go_on_down_to_a_fifth_of_a_percent() -> None:
    for lost, is_copied in ((2, True), (1, False)):
        copies = PacketCopies()
        assert told(copies, 5, 995, 1.0)
        assert told(copies, lost, 1000 - lost, 6.1) is is_copied


@pytest.mark.parametrize(("packets", "is_known"), [(59, False), (60, True)])
def test_of_a_few_packets_nothing_is_concluded(packets: int, is_known: bool) -> None:
    copies = PacketCopies()
    copies.reported(2, packets - 2, 1.0, is_queued=False)
    assert (copies.loss > 0.0) is is_known


def test_what_was_lost_five_seconds_ago_no_longer_counts() -> None:
    copies = PacketCopies()
    copies.reported(100, 900, 1.0, is_queued=False)
    copies.reported(0, 1000, 6.0, is_queued=False)
    assert copies.loss == 0.05
    copies.reported(0, 1000, 6.01, is_queued=False)
    assert copies.loss == 0.0


@pytest.mark.parametrize(("lost", "doubles"), [(1, False), (2, True), (149, True), (150, False)])
def test_a_packet_that_was_asked_for_is_doubled_from_a_little_loss_on(lost: int, doubles: bool) -> None:
    copies = PacketCopies()
    copies.reported(lost, 1000 - lost, 1.0, is_queued=False)
    assert copies.doubles_repeats is doubles


@pytest.mark.parametrize(("lost", "share"), [(19, 1.0), (20, 0.5), (149, 0.5), (150, 1.0)])
def test_half_of_a_full_path_is_for_copies_from_two_percent_on(lost: int, share: float) -> None:
    copies = PacketCopies()
    copies.reported(lost, 1000 - lost, 1.0, is_queued=False)
    assert copies.picture_bps(1_000_000, is_limited=True) == 1_000_000 * share


def pause_s(copies: PacketCopies, queued_at_s: float) -> float:
    """How long after a queue copies begin again, to a tenth of a second."""
    assert not told(copies, 50, 950, queued_at_s, is_queued=True)
    return next(step / 10 for step in range(1000) if told(copies, 50, 950, queued_at_s + step / 10))


def test_a_pause_is_five_seconds_and_twice_as_long_each_time_up_to_a_minute() -> None:
    copies, now_s, pauses = PacketCopies(), 1.0, []
    told(copies, 50, 950, now_s)
    for _ in range(6):
        pauses.append(pause_s(copies, now_s))
        now_s += pauses[-1]
    assert pauses == [5.0, 10.0, 20.0, 40.0, 60.0, 60.0]


@pytest.mark.parametrize(("later_s", "second_s"), [(9.9, 10.0), (10.0, 5.0)])
def test_a_queue_ten_seconds_after_they_began_is_not_theirs(later_s: float, second_s: float) -> None:
    copies = PacketCopies()
    told(copies, 50, 950, 1.0)
    began_s = 1.0 + pause_s(copies, 1.0)
    assert pause_s(copies, began_s + later_s) == second_s


def test_more_of_the_packets_are_copied_with_each_report_until_all_are() -> None:
    copies, shares = PacketCopies(), []
    for step in range(7):
        copies.reported(50, 950, 1.0 + step, is_queued=False)
        copies.wants(10**9, SPARE_BPS, 1.0 + step)
        size_bytes = SPARE_BPS / 8 * 0.25
        shares.append(max(tenth for tenth in range(11) if copies_at(copies, size_bytes * tenth / 10.01, 1.5 + step)))
    assert shares == [2, 4, 6, 8, 10, 10, 10]


def copies_at(copies: PacketCopies, size_bytes: float, now_s: float) -> bool:
    return copy.deepcopy(copies).wants(round(size_bytes), SPARE_BPS, now_s)
