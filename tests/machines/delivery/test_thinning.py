"""The rate is kept, and the newest value always arrives."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.delivery.thinning import Thinner


def test_the_first_goes_at_once_and_the_newest_of_a_period_when_it_is_over() -> None:
    it: Thinner[str] = Thinner(10.0)
    assert it.offer("a", 0.0) == "a"
    assert it.due_at_s is None
    assert it.offer("b", 0.03) is None
    assert it.offer("c", 0.06) is None
    assert it.due_at_s == pytest.approx(0.1)
    assert it.due(0.09) is None
    assert it.due(0.1) == "c"
    assert it.thinned == 1
    assert it.due(0.2) is None


def test_a_value_that_comes_when_the_kept_one_is_due_takes_its_place() -> None:
    it: Thinner[str] = Thinner(10.0)
    it.offer("a", 0.0)
    it.offer("b", 0.05)
    assert it.offer("c", 0.11) == "c"
    assert (it.due(0.2), it.thinned) == (None, 1)


def test_a_timer_that_is_a_little_late_does_not_lower_the_rate() -> None:
    it: Thinner[int] = Thinner(10.0)
    now_s, out = 0.0, 0
    for number in range(1000):
        now_s = number * 0.01 + 0.004
        out += (it.offer(number, now_s) is not None) + (it.due(now_s + 0.003) is not None)
    assert 99 <= out <= 101


@pytest.mark.parametrize("rate_hz", [0.0, -1.0, float("nan")])
def test_a_rate_must_be_positive(rate_hz: float) -> None:
    with pytest.raises(ValueError, match="positive"):
        Thinner(rate_hz)


@given(
    gaps_s=st.lists(st.floats(0, 0.3), min_size=1, max_size=80),
    rate_hz=st.floats(0.5, 50),
    lateness_s=st.floats(0, 0.02),
)
def test_however_values_come_the_rate_is_kept_and_the_newest_is_the_last_to_go(
    gaps_s: list[float], rate_hz: float, lateness_s: float
) -> None:
    it: Thinner[int] = Thinner(rate_hz)
    out: list[tuple[float, int]] = []
    now_s = 0.0

    def wait_until(until_s: float) -> None:
        """The driver's timer, which may be late."""
        due_at_s = it.due_at_s
        if due_at_s is not None and due_at_s + lateness_s <= until_s:
            value = it.due(due_at_s + lateness_s)
            assert value is not None
            out.append((due_at_s + lateness_s, value))

    for number, gap_s in enumerate(gaps_s):
        wait_until(now_s + gap_s)
        now_s += gap_s
        value = it.offer(number, now_s)
        if value is not None:
            assert value == number
            out.append((now_s, value))
    wait_until(float("inf"))
    sent = [value for _, value in out]
    assert sent == sorted(sent)
    assert sent[-1] == len(gaps_s) - 1
    assert len(sent) + it.thinned == len(gaps_s)
    for first, (at_s, _) in enumerate(out):
        for last in range(first + 1, len(out)):
            assert (last - first - 1) / rate_hz <= out[last][0] - at_s + 1e-6
