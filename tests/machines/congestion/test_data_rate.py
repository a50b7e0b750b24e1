"""What messages take is counted over the last second, to a twentieth of it."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.congestion.data_rate import SLOT_S, DataRate


def test_nothing_has_left() -> None:
    assert DataRate().bps(5.0) == 0.0


def test_what_left_within_the_last_second_counts_and_older_does_not() -> None:
    rate = DataRate()
    rate.left(1000, 10.01)
    rate.left(500, 10.02)
    rate.left(250, 10.52)
    assert rate.bps(10.6) == 8 * 1750
    assert rate.bps(10.99) == 8 * 1750
    assert rate.bps(11.06) == 8 * 250
    assert rate.bps(11.56) == 0.0


def test_a_steady_sensor_is_counted_as_what_it_takes() -> None:
    rate = DataRate()
    for step in range(200):
        rate.left(750, 3.0 + 0.02 * step)
    assert abs(rate.bps(3.0 + 0.02 * 199) - 300_000) < 300_000 * SLOT_S


@given(st.lists(st.tuples(st.integers(1, 5000), st.floats(0, 0.4)), max_size=200))
def test_it_counts_each_packet_for_a_second_or_a_slot_less(packets: list[tuple[int, float]]) -> None:
    rate, now_s, left = DataRate(), 0.0, []
    for size_bytes, later_s in packets:
        now_s += later_s
        rate.left(size_bytes, now_s)
        left.append((now_s, size_bytes))
    surely = sum(size for at_s, size in left if at_s > now_s - 1.0 + SLOT_S)
    perhaps = sum(size for at_s, size in left if at_s > now_s - 1.0 - SLOT_S)
    assert 8 * surely <= rate.bps(now_s) <= 8 * perhaps
