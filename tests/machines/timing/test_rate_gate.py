"""Never more than the rate over any time, but for one burst."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.timing.rate_gate import BURST_S, RateGate


def test_commands_at_the_rate_all_pass() -> None:
    gate = RateGate(50.0)
    assert all(gate.admits(tick * 0.02) for tick in range(1000))


def test_twice_the_rate_is_halved() -> None:
    gate = RateGate(50.0)
    passed = sum(gate.admits(tick * 0.01) for tick in range(1000))
    assert passed == pytest.approx(500 + 50 * BURST_S, abs=2)


def test_what_a_network_held_back_passes_at_once() -> None:
    gate = RateGate(40.0)
    assert [gate.admits(1.0) for _ in range(12)] == [True] * 10 + [False] * 2


def test_without_a_rate_everything_passes() -> None:
    gate = RateGate(None)
    assert all(gate.admits(0.0) for _ in range(1000))


def test_a_clock_that_goes_back_gives_nothing() -> None:
    gate = RateGate(4.0)
    while gate.admits(10.0):
        pass
    assert not gate.admits(-1e9)
    assert not gate.admits(10.0)
    assert gate.admits(10.25)


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan")])
def test_a_rate_must_be_positive(rate: float) -> None:
    with pytest.raises(ValueError, match="positive"):
        RateGate(rate)


@given(st.floats(0.5, 500), st.lists(st.floats(0, 0.2), max_size=200))
def test_over_any_history_never_more_than_rate_and_burst(rate: float, steps: list[float]) -> None:
    gate, now_s, passed = RateGate(rate), 0.0, 0
    for step_s in steps:
        now_s += step_s
        passed += gate.admits(now_s)
        assert passed <= now_s * rate + max(2.0, rate * BURST_S) + 1e-6
