"""What is new and young passes the gates of age and sequence, whatever the clocks say."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.commands.admission import ArrivedCommand, CommandChannel, refusal_on_arrival
from mosaic_core.machines.commands.command_order import CLOCK_DRIFT, ArrivalBaseline, CommandOrder
from mosaic_core.machines.control.lease_desk import LeaseDesk
from mosaic_core.machines.control.stop_latch import StopLatch
from mosaic_core.machines.delivery.framing import SEQ_MODULUS
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety


class Gates:
    """Both gates of one channel."""

    def __init__(self, max_age_s: float | None, baseline: ArrivalBaseline) -> None:
        self._order = CommandOrder(baseline)
        self._channel = CommandChannel(ReceiverSafety(), LeaseDesk(()), StopLatch(), max_age_s=max_age_s)

    def refusal(self, seq: int, stamp_us: int, now_s: float) -> str | None:
        age_s, is_newest = self._order.arrived(seq, stamp_us, now_s)
        refused = refusal_on_arrival(ArrivedCommand(self._channel, "p", "operator", True, 0, now_s, age_s, is_newest))
        return refused.code if refused is not None else None


def gate(max_age_s: float | None = 0.3) -> Gates:
    return Gates(max_age_s, ArrivalBaseline())


def us(seconds: float) -> int:
    return round(seconds * 1e6)


def test_repeated_and_overtaken_messages_are_out_of_order() -> None:
    it = gate()
    assert it.refusal(5, us(1), 1.0) is None
    assert it.refusal(5, us(1), 1.0) == "safety.out_of_order"
    assert it.refusal(4, us(1), 1.0) == "safety.out_of_order"
    assert it.refusal(7, us(1), 1.0) is None


def test_the_number_wraps() -> None:
    it = gate()
    assert it.refusal(SEQ_MODULUS - 1, us(1), 1.0) is None
    assert it.refusal(0, us(1), 1.0) is None
    assert it.refusal(SEQ_MODULUS - 1, us(1), 1.0) == "safety.out_of_order"


def test_a_message_that_took_too_long_is_stale() -> None:
    it = gate()
    assert it.refusal(1, us(100.0), 1.0) is None
    assert it.refusal(2, us(100.1), 1.35) is None
    assert it.refusal(3, us(100.2), 1.6) == "safety.stale"
    assert it.refusal(4, us(100.6), 1.7) is None


def test_a_number_counts_as_seen_also_where_its_command_was_refused() -> None:
    it = gate()
    assert it.refusal(1, us(100.0), 1.0) is None
    assert it.refusal(5, us(100.1), 2.0) == "safety.stale"
    assert it.refusal(4, us(101.0), 2.0) == "safety.out_of_order", "an older one may not act either"


def test_without_an_age_limit_only_the_order_counts() -> None:
    it = gate(None)
    assert it.refusal(1, us(1.0), 1.0) is None
    assert it.refusal(2, us(1.0), 500.0) is None


def test_an_unknown_stamp_is_not_judged_by_age() -> None:
    it = gate()
    assert it.refusal(1, us(1.0), 1.0) is None
    assert it.refusal(2, 0, 900.0) is None


def test_the_first_command_is_measured_against_what_other_channels_showed() -> None:
    baseline = ArrivalBaseline()
    baseline.age_s(us(10.0), 1.0)
    assert Gates(0.3, baseline).refusal(1, us(10.0), 2.0) == "safety.stale"


def test_hours_of_drift_between_two_clocks_refuse_nothing() -> None:
    it, drift = gate(), 1 - 200e-6
    for number in range(1, 4000):
        now_s = number * 10.0
        assert it.refusal(number, us(now_s * drift), now_s) is None


def test_a_burst_after_a_long_silence_is_still_old() -> None:
    it = gate()
    assert it.refusal(1, us(1.0), 1.0) is None
    assert it.refusal(2, us(1.1), 61.1) == "safety.stale"


Steps = st.lists(st.tuples(st.floats(0.001, 0.2), st.floats(0.0, 1.0)), min_size=1, max_size=40)


@given(Steps, st.floats(0, 7200))
def test_the_skew_between_the_clocks_changes_nothing(steps: list[tuple[float, float]], skew_s: float) -> None:
    straight, skewed = gate(), gate()
    sent_s = 10_000.0
    for number, (gap_s, delay_s) in enumerate(steps, start=1):
        sent_s += gap_s
        arrival_s = sent_s + delay_s
        if abs(delay_s - 0.3) < 1e-3:
            continue
        first = straight.refusal(number, us(sent_s), arrival_s)
        second = skewed.refusal(number, us(sent_s + skew_s - 3600), arrival_s)
        if first != second:  # only rounding at the very edge may differ
            pytest.fail(f"{first} without skew, {second} with {skew_s - 3600}")


@given(st.lists(st.integers(1, 200), min_size=1, max_size=80))
def test_no_message_acts_twice_and_none_after_a_newer_one(numbers: list[int]) -> None:
    it, acted = gate(None), []
    for number in numbers:
        if it.refusal(number, us(1.0), 1.0) is None:
            acted.append(number)
    assert acted == sorted(set(acted))
    assert max(numbers) in acted


# -- the baseline, to the microsecond


def ages(*frames: tuple[int, float]) -> list[float]:
    baseline = ArrivalBaseline()
    return [baseline.age_s(stamp_us, now_s) for stamp_us, now_s in frames]


def test_an_unknown_stamp_has_no_age() -> None:
    assert ages((0, 5.0), (us(1), 5.0), (0, 99.0)) == [0.0, 0.0, 0.0]


def test_an_age_is_what_a_message_took_longer_than_the_fastest() -> None:
    assert ages((us(1000), 5.0), (us(1), 5.0))[1] == pytest.approx(999.0, abs=1e-6)


@pytest.mark.parametrize("passed_s", [0.1, 10.0])
def test_the_fastest_counts_for_less_as_the_clocks_drift(passed_s: float) -> None:
    slow = (us(1000 + passed_s), 1000 + passed_s + 0.5)
    assert ages((us(1000), 1000.0), slow)[1] == pytest.approx(0.5 - (passed_s + 0.5) * CLOCK_DRIFT, abs=1e-6)


def test_a_clock_that_goes_back_makes_no_message_older() -> None:
    assert ages((us(10), 10.0), (us(9), 9.5))[1] == pytest.approx(0.5, abs=1e-6)


def test_a_message_of_just_the_greatest_age_may_act() -> None:
    it = gate(0.25)
    assert it.refusal(1, us(1.25), 1.25) is None
    assert it.refusal(2, us(1.0), 1.25) is None
    assert it.refusal(3, us(0.99), 1.25) == "safety.stale"
