"""As few acknowledgements as the sender bears."""

from __future__ import annotations

import pytest

from mosaic_core.machines.congestion.ack_pace import FEWER_AFTER, LEAST, MOST, AckPace


def test_it_begins_with_every_second_packet() -> None:
    assert AckPace().packets == LEAST == 2


def test_a_flow_that_goes_on_is_acknowledged_more_and_more_seldom_up_to_a_bound() -> None:
    pace, seen = AckPace(), []
    for _ in range(FEWER_AFTER * (MOST + 5)):
        pace.kept_up()
        seen.append(pace.packets)
    assert seen == sorted(seen)
    assert seen[FEWER_AFTER - 2 : FEWER_AFTER] == [LEAST, LEAST + 1]
    assert seen[2 * FEWER_AFTER - 2 : 2 * FEWER_AFTER] == [LEAST + 1, LEAST + 2], "each step takes as long"
    assert seen[-1] == MOST


def test_a_sender_that_waits_is_acknowledged_more_often_at_once() -> None:
    pace = AckPace()
    for _ in range(FEWER_AFTER * MOST):
        pace.kept_up()
    pace.stalled(10)
    assert pace.packets == 5
    pace.stalled(3)
    assert pace.packets == LEAST
    pace.stalled(14)
    assert pace.packets == LEAST


@pytest.mark.parametrize("burst", [4, 6, 16])
def test_a_sender_of_small_bursts_hardly_ever_waits(burst: int) -> None:
    """Each acknowledgement lets it send ``burst`` more, of a window of 100."""
    pace, flight, stalls, acknowledgements = AckPace(), burst, 0, 0
    for _ in range(20_000):
        if flight >= pace.packets:
            flight -= pace.packets
            pace.kept_up()
        else:
            stalls += 1
            pace.stalled(flight)
            flight = 0
        acknowledgements += 1
        flight = min(100, flight + burst)
    assert stalls < acknowledgements / 50
