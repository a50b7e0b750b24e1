"""A viewer's bit rate: starts low, ramps up, backs off, recovers, and never leaves its limits."""

from __future__ import annotations

import random
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mosaic_core.machines.congestion.feedback import BandwidthEstimate, PacketsMissing, PictureLost, ReceiverReport
from mosaic_core.machines.congestion.rate_control import START_BPS, RateControl

MIN_BPS, MAX_BPS = 150_000, 4_000_000


class Link:
    """Plays a link that takes ``capacity_bps``: what is beyond it waits, then is lost. One report per second."""

    def __init__(self, capacity_bps: float, *, random_loss: float = 0.0, used: float = 1.0) -> None:
        self.rate = RateControl(MIN_BPS, MAX_BPS, 0.0)
        self.capacity_bps = capacity_bps
        self.random_loss = random_loss
        self.used = used
        self.now_s = 0.0
        self.queue_bits = 0.0
        self.packets = self.lost = 0
        self.rate.handle(ReceiverReport(0, 0), 0.0)
        self.history: list[int] = []

    def play(self, seconds: int) -> Link:
        for _ in range(seconds):
            sent, lost = 0.0, 0.0
            for _ in range(30):
                self.now_s += 1 / 30
                bits = self.rate.budget_bps * self.used / 30
                self.rate.sent(round(bits / 8), self.now_s)
                sent += bits
                self.queue_bits = max(0.0, self.queue_bits + bits - self.capacity_bps / 30)
                if self.queue_bits > self.capacity_bps * 0.5:
                    lost += self.queue_bits - self.capacity_bps * 0.5
                    self.queue_bits = self.capacity_bps * 0.5
            share = min(1.0, lost / sent + self.random_loss) if sent else 0.0
            self.packets += 1000
            self.lost += round(1000 * share)
            round_trip_s = 0.03 + self.queue_bits / self.capacity_bps
            self.rate.handle(ReceiverReport(self.lost, self.packets, round_trip_s), self.now_s)
            self.rate.tick(self.now_s)
            self.history.append(self.rate.budget_bps)
        return self


def test_it_starts_low() -> None:
    assert RateControl(MIN_BPS, MAX_BPS, 0.0).budget_bps == START_BPS
    assert RateControl(MIN_BPS, 400_000, 0.0).budget_bps == 400_000
    assert RateControl(1_000_000, MAX_BPS, 0.0).budget_bps == 1_000_000


def test_on_a_good_link_it_is_at_its_best_within_seconds() -> None:
    assert Link(20_000_000).play(6).rate.budget_bps == MAX_BPS


def test_however_often_the_viewer_reports_it_grows_as_fast() -> None:
    budgets_bps = []
    for reports_per_s in (1, 2):
        rate = RateControl(MIN_BPS, 50 * MAX_BPS, 0.0)
        for number in range(4 * reports_per_s + 1):
            now_s = number / reports_per_s
            rate.sent(rate.budget_bps // 8, now_s)
            rate.handle(ReceiverReport(0, 1000 * number, 0.03), now_s)
        budgets_bps.append(rate.budget_bps)
    assert budgets_bps[1] == pytest.approx(budgets_bps[0], rel=0.01)
    assert budgets_bps[0] > 2 * START_BPS


def test_on_a_narrow_link_it_stays_near_what_the_link_takes() -> None:
    link = Link(1_000_000).play(60)
    settled = link.history[20:]
    assert 550_000 < sum(settled) / len(settled) < 1_100_000
    assert max(settled) < 1_500_000


def test_it_recovers_when_the_link_does() -> None:
    link = Link(4_000_000).play(15)
    link.capacity_bps = 1_000_000
    link.play(20)
    assert link.rate.budget_bps < 1_300_000
    link.capacity_bps = 6_000_000
    link.play(45)
    assert link.rate.budget_bps > 3_000_000


@pytest.mark.parametrize("random_loss", [0.01, 0.03])
def test_a_radio_link_that_loses_a_little_is_still_used(random_loss: float) -> None:
    assert Link(20_000_000, random_loss=random_loss).play(15).rate.budget_bps == MAX_BPS


def test_moderate_loss_neither_grows_nor_shrinks_it() -> None:
    assert set(Link(20_000_000, random_loss=0.08).play(10).history) == {START_BPS}


@pytest.mark.parametrize("seed", range(5))
def test_what_chance_explains_is_not_held_against_a_link(seed: int) -> None:
    rate, chance = RateControl(MIN_BPS, MAX_BPS, 0.0), random.Random(seed)
    sent = lost = 0
    for tenth in range(1, 600):  # a minute of a link that loses 8 %
        now_s = tenth / 10
        for _ in range(max(1, rate.budget_bps // 96_000)):
            rate.sent(1200, now_s)
            sent += 1
            lost += chance.random() < 0.08
        rate.handle(ReceiverReport(lost, sent, 0.05), now_s)
    assert rate.budget_bps > START_BPS / 3


def test_heavy_loss_brings_it_down_to_the_least() -> None:
    assert Link(20_000_000, random_loss=0.4).play(20).rate.budget_bps == MIN_BPS


def test_without_traffic_it_grows_slowly_for_nothing_is_proved() -> None:
    idle, busy = Link(20_000_000, used=0.1).play(5), Link(20_000_000).play(5)
    assert START_BPS < idle.rate.budget_bps < busy.rate.budget_bps / 2


def report(rate: RateControl, lost: float, now_s: float) -> None:
    """Two reports, a second apart, between which ``lost`` of the packets were lost."""
    rate.handle(ReceiverReport(0, 0), now_s - 1.0)
    rate.handle(ReceiverReport(round(1000 * lost), 1000), now_s)


def sending(rate: RateControl, seconds: float, now_s: float) -> float:
    for _ in range(int(seconds * 30)):
        now_s += 1 / 30
        rate.sent(rate.budget_bps // 8 // 30, now_s)
    return now_s


def test_an_estimate_says_how_far_to_back_off_and_nothing_while_reports_are_clean() -> None:
    rate = RateControl(MIN_BPS, MAX_BPS, 0.0)
    now_s = sending(rate, 2, 0.0)
    rate.handle(BandwidthEstimate(500_000), now_s)
    assert rate.budget_bps == START_BPS
    report(rate, 0.15, now_s)
    assert 300_000 < rate.budget_bps < 500_000, "below it, so that the queue drains"


def test_an_estimate_of_a_receiver_that_gets_little_says_nothing() -> None:
    rate = RateControl(MIN_BPS, MAX_BPS, 0.0)
    rate.sent(3_000, 1.0)
    rate.handle(BandwidthEstimate(200_000), 1.0)
    report(rate, 0.15, 1.0)
    assert rate.budget_bps > 300_000


def test_growth_is_slower_where_the_receiver_estimates_less() -> None:
    budgets = []
    for estimate_bps in (500_000, 50_000_000):
        rate = RateControl(MIN_BPS, MAX_BPS, 0.0)
        now_s = sending(rate, 2, 0.0)
        rate.handle(BandwidthEstimate(estimate_bps), now_s)
        report(rate, 0.0, now_s)
        budgets.append(rate.budget_bps)
    assert START_BPS < budgets[0] < budgets[1]


def reported(rate: RateControl, round_trips_s: list[float | None], from_s: float = 0.0) -> float:
    """One clean report per second, each with a round trip, while as much as it allows is sent; when that ends."""
    for number, round_trip_s in enumerate(round_trips_s):
        now_s = sending(rate, 1, from_s + number)
        rate.handle(ReceiverReport(0, 1000 * round(now_s + 1), round_trip_s), now_s)
    return from_s + len(round_trips_s)


def test_the_round_trip_is_that_of_the_newest_report_which_tells_one() -> None:
    rate = RateControl(MIN_BPS, MAX_BPS, 0.0)
    assert rate.round_trip_s is None
    reported(rate, [0.05, 0.03, None])
    assert rate.round_trip_s == 0.03


def test_a_round_trip_that_was_told_half_a_minute_ago_is_told_no_more() -> None:
    rate = RateControl(MIN_BPS, MAX_BPS, 0.0)
    now_s = reported(rate, [0.05, *[None] * 29])
    assert rate.round_trip_s == 0.05
    reported(rate, [None] * 2, now_s)
    assert rate.round_trip_s is None


def test_a_path_that_has_become_longer_for_good_is_no_queue_after_half_a_minute() -> None:
    rate = RateControl(MIN_BPS, MAX_BPS, 0.0)
    now_s = reported(rate, [0.03] * 3)
    before_bps = rate.budget_bps
    now_s = reported(rate, [0.3] * 20, now_s)
    assert rate.budget_bps < before_bps / 2, "a queue, as far as anybody knows"
    reported(rate, [0.3] * 40, now_s)
    assert rate.budget_bps > before_bps


@pytest.mark.parametrize(
    ("shortest_s", "newest_s", "is_queue"),
    [(0.03, 0.15, False), (0.03, 0.16, True), (0.2, 0.4, False), (0.2, 0.41, True)],
)
def test_a_queue_is_a_round_trip_longer_than_the_shortest_by_as_much_again_and_by_more_than_jitter(
    shortest_s: float, newest_s: float, is_queue: bool
) -> None:
    rate = RateControl(MIN_BPS, MAX_BPS, 0.0)
    now_s = reported(rate, [shortest_s] * 2)
    before_bps = rate.budget_bps
    reported(rate, [newest_s], now_s)
    assert (rate.budget_bps < before_bps) is is_queue


def test_a_queue_of_which_nothing_was_heard_lately_stands_no_more() -> None:
    rate = RateControl(MIN_BPS, MAX_BPS, 0.0)
    now_s = reported(rate, [0.03, 0.03, 0.5])
    low_bps = rate.budget_bps
    reported(rate, [None] * 4, now_s)
    assert rate.budget_bps > low_bps


def test_packets_asked_for_again_count_before_the_report_comes() -> None:
    rate = RateControl(MIN_BPS, MAX_BPS, 0.0)
    now_s = sending(rate, 2, 0.0)
    rate.handle(PacketsMissing(5), now_s)
    assert rate.budget_bps == START_BPS
    rate.handle(PacketsMissing(40), now_s + 0.1)
    assert rate.budget_bps < START_BPS


def test_pictures_lost_again_and_again_count() -> None:
    rate = RateControl(MIN_BPS, MAX_BPS, 0.0)
    now_s = sending(rate, 2, 0.0)
    for number in range(3):
        assert rate.budget_bps == START_BPS
        rate.handle(PictureLost(), now_s + number * 0.5)
    assert rate.budget_bps < START_BPS


def test_of_lost_pictures_the_last_three_count_whenever_others_were_lost() -> None:
    rate = RateControl(MIN_BPS, MAX_BPS, 0.0)
    for at_s in (0.0, 10.0, 20.0, 22.0):
        rate.handle(PictureLost(), at_s)
    assert rate.budget_bps == START_BPS
    rate.handle(PictureLost(), 23.0)
    assert rate.budget_bps < START_BPS, "three within three seconds"


def test_a_lost_picture_now_and_then_is_no_congestion() -> None:
    rate = RateControl(MIN_BPS, MAX_BPS, 0.0)
    for number in range(20):
        rate.handle(PictureLost(), number * 2.0)
    assert rate.budget_bps == START_BPS


def test_reports_about_a_handful_of_packets_are_added_up() -> None:
    rate = RateControl(MIN_BPS, MAX_BPS, 0.0)
    for number in range(20):  # one packet of fifty is lost, and a report comes with every NACK
        rate.handle(ReceiverReport(packets_lost=number // 10, highest_sequence=5 * number), number * 0.02)
    assert rate.budget_bps == START_BPS


def test_silence_backs_off_but_only_while_something_is_sent() -> None:
    quiet = RateControl(MIN_BPS, MAX_BPS, 0.0)
    quiet.tick(60.0)
    assert quiet.budget_bps == START_BPS
    unheard = RateControl(MIN_BPS, MAX_BPS, 0.0)
    now_s = 0.0
    for _ in range(30):
        now_s = sending(unheard, 0.5, now_s)
        unheard.tick(now_s)
    assert unheard.budget_bps == MIN_BPS


def test_silence_of_four_seconds_backs_off_and_again_every_two_seconds() -> None:
    rate, cut_at_s = RateControl(MIN_BPS, MAX_BPS, 0.0), []
    for half_s in range(1, 18):
        before_bps = rate.budget_bps
        rate.sent(rate.budget_bps // 16, half_s / 2)
        rate.tick(half_s / 2)
        if rate.budget_bps < before_bps:
            cut_at_s.append(half_s / 2)
    assert cut_at_s == [4.0, 6.0, 8.0]


def test_other_limits_hold_at_once() -> None:
    rate = RateControl(MIN_BPS, MAX_BPS, 0.0)
    rate.limit(MIN_BPS, 300_000)
    assert rate.budget_bps == 300_000
    rate.limit(900_000, MAX_BPS)
    assert rate.budget_bps == 900_000


FEEDBACK = st.one_of(
    st.builds(ReceiverReport, st.integers(-5, 10**6), st.integers(0, 2**32), st.none() | st.floats(0, 10)),
    st.builds(BandwidthEstimate, st.integers(0, 10**9)),
    st.builds(PacketsMissing, st.integers(0, 500)),
    st.builds(PictureLost),
    st.integers(0, 100_000),  # bytes sent
    st.none(),  # a tick
)


@given(st.lists(st.tuples(FEEDBACK, st.floats(0, 5)), max_size=100))
def test_whatever_comes_it_stays_within_its_limits(events: list[tuple[Any, float]]) -> None:
    rate, now_s = RateControl(MIN_BPS, MAX_BPS, 0.0), 0.0
    for event, passed_s in events:
        now_s += passed_s
        before = rate.budget_bps
        if event is None:
            rate.tick(now_s)
        elif isinstance(event, int):
            rate.sent(event, now_s)
        else:
            rate.handle(event, now_s)
        assert MIN_BPS <= rate.budget_bps <= MAX_BPS
        if not isinstance(event, ReceiverReport):
            assert rate.budget_bps <= before, "only a clean report lets it grow"


@settings(max_examples=30)
@given(st.floats(400_000, 3_500_000))
def test_no_narrow_link_is_overrun_for_long(capacity_bps: float) -> None:
    link = Link(capacity_bps).play(60)
    settled = link.history[25:]
    assert sum(settled) / len(settled) < 1.15 * capacity_bps
    assert sum(settled) / len(settled) > 0.4 * capacity_bps


def test_what_was_sent_counts_for_less_than_a_second() -> None:
    rate = RateControl(MIN_BPS, MAX_BPS, 0.0)
    rate.sent(1000, 10.0)
    assert [rate.sent_bps(now_s) for now_s in (10.0, 10.75, 11.0)] == [8000, 8000, 0]
