"""Copies cover loss beside what the path takes, and give way as soon as it takes no more."""

from __future__ import annotations

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
