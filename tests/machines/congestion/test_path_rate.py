"""A viewer's bit rate where packets tell of the path: up where there is room, down at once where a queue stands."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.congestion.feedback import BandwidthEstimate, PacketsMissing, PictureLost, ReceiverReport
from mosaic_core.machines.congestion.path_rate import PathRate
from mosaic_core.machines.congestion.path_watch import PathSeen

MIN_BPS, MAX_BPS, START_BPS = 150_000, 4_000_000, 800_000
REPORT_S = 0.1


class Viewer:
    """Sends what its budget allows, and hears of it every 0.1 s."""

    def __init__(self) -> None:
        self.rate = PathRate(MIN_BPS, MAX_BPS, 0.0, START_BPS)
        self.now_s = 0.0

    def hear(self, times: int = 1, *, sends: float = 1.0, lost: int = 0, received: int = 20, queue_s: float = 0.0,
             newest_queue_s: float | None = None, empties_in_s: float = 0.0, path_bps: float | None = None,
             trains_bps: float | None = None, left: float | None = None) -> Viewer:  # fmt: skip
        for _ in range(times):
            self.now_s += REPORT_S
            self.rate.sent(round(self.rate.budget_bps * sends * REPORT_S / 8), self.now_s)
            newest_s = queue_s if newest_queue_s is None else newest_queue_s
            self.rate.handle(
                PathSeen(
                    queue_s, newest_s, self.now_s - 0.03, received, lost, empties_in_s, path_bps, trains_bps, left
                ),
                self.now_s,
            )
        return self


def test_it_starts_where_it_was_and_stays_within_its_limits() -> None:
    assert PathRate(MIN_BPS, MAX_BPS, 0.0, START_BPS).budget_bps == START_BPS
    assert PathRate(MIN_BPS, 400_000, 0.0, START_BPS).budget_bps == 400_000
    rate = PathRate(MIN_BPS, MAX_BPS, 0.0, START_BPS)
    rate.limit(1_000_000, 2_000_000)
    assert rate.budget_bps == 1_000_000
    rate.limit(1_200_000, 500_000)
    assert rate.budget_bps == 1_200_000, "the least that a picture needs counts before the most that it may have"


def test_before_anything_has_come_back_nothing_is_known() -> None:
    rate = PathRate(MIN_BPS, MAX_BPS, 0.0, START_BPS)
    assert (rate.loss, rate.is_queued, rate.round_trip_s, rate.room_bps(0.0)) == (0.0, False, None, None)
    assert rate.most_bps(0.0) == 2 * START_BPS


def test_where_pictures_come_through_much_faster_it_grows_quickly() -> None:
    assert Viewer().hear(40, trains_bps=20e6).rate.budget_bps == MAX_BPS


@pytest.mark.parametrize(("room", "per_second"), [(1.31, 1.6), (1.3, 1.25), (1.12, 1.25), (1.1, 1.0), (0.5, 1.0)])
def test_it_grows_by_how_much_faster_pictures_come_through_than_it_sends(room: float, per_second: float) -> None:
    viewer = Viewer().hear(10, trains_bps=START_BPS)
    assert viewer.rate.budget_bps == START_BPS
    grown = viewer.hear(1, trains_bps=room * START_BPS).rate.budget_bps / START_BPS
    assert grown == pytest.approx(per_second**REPORT_S, rel=1e-5)


def test_where_that_is_not_known_it_grows_all_the_same() -> None:
    assert Viewer().hear(50).rate.budget_bps > 2 * START_BPS


def test_little_sent_proves_little() -> None:
    assert Viewer().hear(50, sends=0.2).rate.budget_bps < 1.6 * START_BPS


def test_it_stops_growing_shortly_before_what_pictures_come_through_at() -> None:
    assert Viewer().hear(100, trains_bps=1e6).rate.budget_bps == pytest.approx(0.9e6, rel=0.03)


def test_a_pause_of_the_reports_saves_up_no_growth() -> None:
    viewer = Viewer().hear(2, trains_bps=20e6)
    before_bps = viewer.rate.budget_bps
    viewer.now_s += 2.0
    assert viewer.hear(1, trains_bps=20e6).rate.budget_bps < 1.3 * before_bps


def test_a_queue_brings_it_below_what_the_path_takes_at_once() -> None:
    viewer = Viewer().hear(60, trains_bps=20e6)
    before_bps = viewer.rate.budget_bps
    viewer.hear(newest_queue_s=0.08, queue_s=0.04, path_bps=1e6, empties_in_s=0.2)
    assert before_bps == MAX_BPS
    assert viewer.rate.budget_bps == 800_000


def test_nothing_is_sent_until_the_queue_has_drained() -> None:
    viewer = Viewer().hear(60, trains_bps=20e6).hear(newest_queue_s=0.08, path_bps=1e6, empties_in_s=0.2)
    assert viewer.now_s + 0.15 < viewer.rate.paused_until_s <= viewer.now_s + 0.2


def test_a_pause_is_short_however_long_the_queue() -> None:
    viewer = Viewer().hear(60, trains_bps=20e6).hear(newest_queue_s=0.5, path_bps=2e5, empties_in_s=3.0)
    assert viewer.rate.paused_until_s <= viewer.now_s + 0.5


def test_packets_of_before_the_cut_only_tell_better_what_the_path_takes() -> None:
    viewer = Viewer().hear(60, trains_bps=20e6).hear(newest_queue_s=0.08, path_bps=2e6, empties_in_s=0.2)
    old = PathSeen(0.2, 0.3, viewer.now_s - 0.01, 10, 0, 0.1, 1e6)
    viewer.rate.handle(old, viewer.now_s + 0.05)
    assert viewer.rate.budget_bps == 800_000
    viewer.rate.handle(old, viewer.now_s + 0.05)
    assert viewer.rate.budget_bps == 800_000


def test_a_queue_that_drains_at_once_is_not_waited_for() -> None:
    viewer = Viewer().hear(60, trains_bps=20e6).hear(newest_queue_s=0.08, path_bps=1e6, empties_in_s=0.05)
    assert viewer.rate.paused_until_s <= viewer.now_s


def late(viewer: Viewer, after_s: float, path_bps: float | None, queue_s: float = 0.2, empties_in_s: float = 0.1,
         trains_bps: float | None = None) -> PathRate:  # fmt: skip
    """Tell it of packets that were sent before its last cut."""
    seen = PathSeen(queue_s, queue_s, viewer.now_s - 0.01, 20, 0, empties_in_s, path_bps, trains_bps)
    viewer.rate.handle(seen, viewer.now_s + after_s)
    return viewer.rate


def test_packets_of_before_the_cut_raise_nothing_and_may_tell_nothing() -> None:
    viewer = Viewer().hear(60, trains_bps=20e6).hear(newest_queue_s=0.08, path_bps=2e6, trains_bps=20e6)
    cut_bps = viewer.rate.budget_bps
    assert late(viewer, 0.05, None).budget_bps == cut_bps
    assert late(viewer, 0.08, 2e6, queue_s=0.0, trains_bps=20e6).budget_bps == cut_bps


def test_where_packets_of_before_the_cut_told_better_it_stays_below_that() -> None:
    viewer = Viewer().hear(60, trains_bps=20e6).hear(newest_queue_s=0.08, path_bps=2e6)
    late(viewer, 0.05, 1e6)
    assert 850_000 < viewer.hear(100).rate.budget_bps < 950_000


def test_packets_of_before_the_cut_prolong_a_pause_and_begin_none() -> None:
    viewer = Viewer().hear(60, trains_bps=20e6).hear(newest_queue_s=0.08, path_bps=1e6, empties_in_s=0.2)
    until_s = late(viewer, 0.1, 1e6, empties_in_s=0.3).paused_until_s
    assert until_s == pytest.approx(viewer.now_s + 0.4, abs=0.05)
    assert late(viewer, 0.45, 1e6, empties_in_s=0.3).paused_until_s == until_s


def test_packets_of_before_a_cut_for_silence_say_nothing() -> None:
    viewer = Viewer().hear(20)
    viewer.rate.sent(10_000, viewer.now_s + 0.9)
    viewer.rate.tick(viewer.now_s + 1.1)
    silent_bps = viewer.rate.budget_bps
    assert late(viewer, 1.2, 0.2e6).budget_bps == silent_bps


def test_packets_of_before_a_cut_for_loss_may_tell_what_the_path_takes() -> None:
    viewer = Viewer().hear(40, trains_bps=20e6).hear(2, lost=120, received=120, trains_bps=20e6)
    assert viewer.rate.budget_bps < MAX_BPS
    assert late(viewer, 0.05, 1e6).budget_bps == 800_000


def test_one_late_report_is_no_queue() -> None:
    viewer = Viewer().hear(20, trains_bps=20e6)
    before_bps = viewer.rate.budget_bps
    viewer.hear(queue_s=0.15).hear()
    assert viewer.rate.budget_bps >= before_bps


def test_one_report_of_a_queue_may_be_a_busy_processor_and_two_are_a_queue() -> None:
    for viewer in (Viewer(), Viewer().hear(20, trains_bps=20e6)):
        assert not viewer.hear(queue_s=0.15).rate.is_queued
        assert viewer.hear(queue_s=0.15).rate.is_queued
        assert not viewer.hear().rate.is_queued


def test_a_queue_is_told_with_the_report_that_it_is_cut_for() -> None:
    viewer = Viewer().hear(60, trains_bps=20e6).hear(newest_queue_s=0.08, queue_s=0.04, path_bps=1e6)
    assert viewer.rate.is_queued
    assert not viewer.hear().rate.is_queued


def test_a_queue_on_a_path_that_takes_far_more_limits_nothing_but_the_rate_itself() -> None:
    viewer = Viewer().hear(2, queue_s=0.15, path_bps=2.5e6)
    assert not viewer.rate.is_limited(viewer.now_s)
    assert viewer.rate.most_bps(viewer.now_s) == 2 * viewer.rate.budget_bps
    viewer.rate.handle(PathSeen(0.2, 0.3, viewer.now_s - 0.01, 10, 0, 0.1, 1e6), viewer.now_s + 0.05)
    assert viewer.rate.is_limited(viewer.now_s + 0.05)


def test_a_queue_that_stands_counts_even_if_nothing_tells_what_the_path_takes() -> None:
    viewer = Viewer().hear(20)
    before_bps = viewer.rate.budget_bps
    assert viewer.hear(4, queue_s=0.1).rate.budget_bps < 0.8 * before_bps


def test_a_key_frame_may_be_a_queue_of_its_own() -> None:
    viewer = Viewer().hear(20, trains_bps=20e6)
    before_bps = viewer.rate.budget_bps
    viewer.rate.sent(20_000, viewer.now_s, is_key=True)
    viewer.hear(3, queue_s=0.12, path_bps=2e6)
    assert viewer.rate.budget_bps >= before_bps


def test_where_it_was_too_much_it_stays_below_until_more_comes_through() -> None:
    viewer = Viewer().hear(60, trains_bps=20e6).hear(newest_queue_s=0.08, path_bps=1e6)
    viewer.hear(100, trains_bps=1e6)
    assert viewer.rate.budget_bps <= 950_000
    assert viewer.rate.is_limited(viewer.now_s)
    viewer.hear(40, trains_bps=8e6)
    assert viewer.rate.budget_bps == MAX_BPS


def test_beside_others_it_grows_no_further_than_what_they_leave_and_tries_for_more_later() -> None:
    viewer = Viewer().hear(60, trains_bps=4e6)
    viewer.hear(newest_queue_s=0.08, path_bps=1e6, trains_bps=4e6, left=0.25)
    assert viewer.hear(50, trains_bps=4e6).rate.budget_bps <= 950_000
    assert viewer.rate.most_bps(viewer.now_s + 20) < 4e6  # copies too
    assert viewer.hear(300, trains_bps=4e6).rate.budget_bps > 3_000_000


def test_a_shaper_that_lets_single_pictures_through_at_once_is_believed_from_the_second_congestion_on() -> None:
    viewer = Viewer()
    for _ in range(2):
        viewer.hear(60, trains_bps=20e6)
        viewer.hear(newest_queue_s=0.08, path_bps=1e6, trains_bps=20e6, left=1.0)
    assert viewer.hear(100, trains_bps=20e6).rate.budget_bps <= 950_000


def test_what_others_leave_is_known_from_a_short_queue_that_stands_too() -> None:
    viewer = Viewer().hear(20, trains_bps=20e6).hear(5, queue_s=0.04, path_bps=1e6, trains_bps=4e6, left=0.25)
    assert viewer.hear(50, trains_bps=4e6).rate.budget_bps <= 950_000


def test_what_others_leave_follows_the_path_when_it_widens() -> None:
    viewer = Viewer().hear(60, trains_bps=4e6)
    viewer.hear(newest_queue_s=0.08, path_bps=1e6, trains_bps=4e6, left=0.25)
    assert viewer.hear(30, trains_bps=16e6).rate.budget_bps > 2_000_000


def test_after_a_congestion_it_grows_no_further_than_what_is_sent_proves() -> None:
    viewer = Viewer().hear(60, trains_bps=20e6).hear(newest_queue_s=0.08, path_bps=1e6)
    at_bps = viewer.hear(12, sends=0.5, trains_bps=20e6).rate.budget_bps
    assert viewer.hear(50, sends=0.5, trains_bps=20e6).rate.budget_bps == at_bps
    assert viewer.hear(50, trains_bps=20e6).rate.budget_bps == MAX_BPS


def test_a_short_queue_that_stands_drains_because_a_little_less_is_sent() -> None:
    viewer = Viewer().hear(20, trains_bps=20e6)
    before_bps = viewer.rate.budget_bps
    assert viewer.hear(4, queue_s=0.04, path_bps=1e6).rate.budget_bps == before_bps
    assert viewer.hear(1, queue_s=0.04, path_bps=1e6).rate.budget_bps == 850_000
    assert viewer.rate.paused_until_s < viewer.now_s


def test_a_queue_of_30_ms_is_none() -> None:
    viewer = Viewer().hear(20, trains_bps=20e6)
    before_bps = viewer.rate.budget_bps
    assert viewer.hear(10, queue_s=0.03, path_bps=1e6).rate.budget_bps == before_bps
    assert viewer.hear(5, queue_s=0.031, path_bps=1e6).rate.budget_bps < before_bps


def test_a_short_queue_that_stays_although_less_is_sent_is_how_that_path_is() -> None:
    viewer = Viewer().hear(20, trains_bps=20e6).hear(20, queue_s=0.04, path_bps=1e6)
    eased_bps = viewer.rate.budget_bps
    assert viewer.hear(100, queue_s=0.04, path_bps=eased_bps).rate.budget_bps > eased_bps


def test_where_packets_are_few_and_all_of_them_late_that_is_how_the_path_is() -> None:
    viewer = Viewer()
    start_bps = viewer.rate.budget_bps
    assert viewer.hear(100, queue_s=0.045).rate.budget_bps > start_bps
    assert viewer.hear(200, queue_s=0.045).rate.usual_s == pytest.approx(0.045, rel=0.05)


@pytest.mark.parametrize("lost", [1, 2])
def test_loss_without_a_queue_is_no_congestion(lost: int) -> None:
    assert Viewer().hear(40, lost=lost, received=20 - lost, trains_bps=20e6).rate.budget_bps == MAX_BPS


def test_loss_raises_nothing_wherever_pictures_come_through_fast() -> None:
    assert Viewer().hear(1, lost=1, received=19, trains_bps=20e6).rate.budget_bps < 1.1 * START_BPS


def test_of_a_few_packets_no_loss_is_told() -> None:
    viewer = Viewer().hear(1, lost=3, received=2)
    assert (viewer.rate.loss, viewer.rate.budget_bps >= START_BPS) == (0.0, True)


def test_a_lot_of_loss_is() -> None:
    viewer = Viewer().hear(40, trains_bps=20e6)
    assert viewer.hear(60, lost=8, received=12, trains_bps=20e6).rate.budget_bps < MAX_BPS / 2


def test_with_some_loss_no_more_is_sent_than_pictures_came_through_at() -> None:
    viewer = Viewer().hear(40, trains_bps=20e6)
    viewer.hear(1, lost=10, received=10, trains_bps=20e6)
    assert viewer.rate.budget_bps == MAX_BPS
    viewer.hear(1, trains_bps=1e6)
    assert viewer.rate.budget_bps == 850_000
    assert viewer.rate.is_limited(viewer.now_s)
    assert viewer.rate.most_bps(viewer.now_s) == 850_000


def test_hardly_any_loss_says_nothing() -> None:
    viewer = Viewer().hear(40, trains_bps=20e6).hear(1, lost=2, trains_bps=20e6)
    assert viewer.hear(1, trains_bps=1e6).rate.budget_bps == MAX_BPS


def test_a_lot_of_loss_costs_half_of_its_share_once_per_second() -> None:
    viewer = Viewer().hear(40, trains_bps=20e6).hear(1, lost=44, received=176, trains_bps=20e6)
    lost = viewer.hear(1, lost=44, received=176, trains_bps=20e6).rate.loss
    while viewer.rate.budget_bps == MAX_BPS:
        lost = viewer.hear(1, lost=44, received=176, trains_bps=20e6).rate.loss
    assert viewer.rate.budget_bps == pytest.approx(MAX_BPS * (1 - lost / 2), rel=0.001)
    assert viewer.rate.is_limited(viewer.now_s)
    once_bps = viewer.rate.budget_bps
    assert viewer.hear(9, lost=44, received=176, trains_bps=20e6).rate.budget_bps == once_bps
    assert viewer.hear(2, lost=44, received=176, trains_bps=20e6).rate.budget_bps < once_bps


def test_after_a_cut_a_queue_is_counted_anew() -> None:
    viewer = Viewer().hear(20, trains_bps=20e6).hear(2, queue_s=0.07, path_bps=1.6e6)
    cut_bps = viewer.rate.budget_bps
    assert viewer.hear(1, queue_s=0.07, path_bps=1.5e6).rate.budget_bps == cut_bps
    assert viewer.hear(1, queue_s=0.07, path_bps=1.5e6).rate.budget_bps == pytest.approx(0.8 * 1.5e6)


def test_what_eased_is_near_what_the_path_takes_and_is_tried_again_after_as_many_reports() -> None:
    viewer = Viewer().hear(20, trains_bps=20e6).hear(5, queue_s=0.04, path_bps=1e6)
    assert viewer.rate.is_limited(viewer.now_s)
    assert viewer.hear(4, queue_s=0.04, path_bps=0.8e6).rate.budget_bps == 850_000
    assert viewer.hear(1, queue_s=0.04, path_bps=0.8e6).rate.budget_bps == pytest.approx(0.85 * 0.8e6)


def test_a_queue_that_did_not_drain_by_what_came_through_of_it_is_eased_again_by_what_others_leave() -> None:
    words = {"queue_s": 0.04, "trains_bps": 4e6, "left": 0.25}
    viewer = Viewer().hear(20, trains_bps=20e6).hear(5, path_bps=1.17e6, **words)
    once_bps = viewer.rate.budget_bps
    assert once_bps == pytest.approx(0.85 * 1.17e6)
    again = viewer.hear(10, path_bps=1.02e6, **words)
    assert again.rate.budget_bps == pytest.approx(0.85 * 1.02e6)


def test_a_congestion_is_forgotten_after_20_s() -> None:
    viewer = Viewer().hear(60, trains_bps=20e6).hear(newest_queue_s=0.08, path_bps=1e6)
    assert viewer.rate.is_limited(viewer.now_s + 19.9)
    assert not viewer.rate.is_limited(viewer.now_s + 20.0)
    assert viewer.rate.most_bps(viewer.now_s + 19.9) == 800_000, "copies would be too much"
    assert viewer.rate.most_bps(viewer.now_s + 20.0) == 1_600_000


def test_silence_is_a_second_without_reports_and_lowers_it_once_per_second() -> None:
    viewer = Viewer().hear(20)
    before_bps, heard_s = viewer.rate.budget_bps, viewer.now_s
    for after_s, factor in ((0.5, 1.0), (0.9, 1.0), (1.01, 0.7), (1.5, 0.7), (1.9, 0.7), (2.02, 0.49)):
        viewer.rate.sent(10_000, heard_s + after_s)
        viewer.rate.tick(heard_s + after_s)
        assert viewer.rate.budget_bps == pytest.approx(factor * before_bps, rel=0.001)


def test_who_has_sent_nothing_for_a_while_is_given_a_second_for_the_first_report() -> None:
    viewer = Viewer().hear(20)
    before_bps, again_s = viewer.rate.budget_bps, viewer.now_s + 5.0
    for after_s in (0.0, 0.5, 0.9):
        viewer.rate.sent(10_000, again_s + after_s)
        viewer.rate.tick(again_s + after_s)
    assert viewer.rate.budget_bps == before_bps
    viewer.rate.sent(10_000, again_s + 1.0)
    viewer.rate.tick(again_s + 1.0)
    assert viewer.rate.budget_bps < before_bps


def test_what_was_sent_is_of_the_last_second() -> None:
    rate = PathRate(MIN_BPS, MAX_BPS, 0.0, START_BPS)
    rate.sent(1000, 10.0)
    rate.sent(500, 10.5)
    assert rate.sent_bps(10.9) == 12_000
    assert rate.sent_bps(11.0) == 4_000


def test_silence_lowers_it_but_only_while_something_is_sent() -> None:
    viewer = Viewer().hear(20)
    before_bps = viewer.rate.budget_bps
    for step in range(4):
        viewer.rate.tick(viewer.now_s + step / 2)
        viewer.rate.sent(10_000, viewer.now_s + step / 2)
    assert viewer.rate.budget_bps < before_bps
    idle = Viewer()
    idle.rate.tick(10.0)
    assert idle.rate.budget_bps == START_BPS


def test_of_other_feedback_only_the_round_trip_counts() -> None:
    rate = PathRate(MIN_BPS, MAX_BPS, 0.0, START_BPS)
    for feedback in (ReceiverReport(90, 100, 0.07), BandwidthEstimate(1000), PacketsMissing(100), PictureLost()):
        rate.handle(feedback, 1.0)
    assert rate.budget_bps == START_BPS
    assert rate.round_trip_s == 0.07


@given(
    st.lists(
        st.tuples(
            st.floats(0, 1), st.floats(0, 2), st.integers(0, 50), st.integers(1, 50), st.floats(0, 5),
            st.one_of(st.none(), st.floats(1, 5e7)), st.one_of(st.none(), st.floats(1, 5e7)), st.booleans(),
        ),
        max_size=60,
    )
)  # fmt: skip
def test_whatever_comes_it_stays_within_its_limits(
    reports: list[tuple[float, float, int, int, float, float | None, float | None, bool]],
) -> None:
    viewer = Viewer()
    for queue_s, more_s, lost, received, empties_in_s, path_bps, trains_bps, is_key in reports:
        viewer.rate.sent(5000, viewer.now_s, is_key=is_key)
        viewer.hear(
            queue_s=queue_s, newest_queue_s=queue_s + more_s, lost=lost, received=received,
            empties_in_s=empties_in_s, path_bps=path_bps, trains_bps=trains_bps,
        )  # fmt: skip
        viewer.rate.tick(viewer.now_s)
        assert MIN_BPS <= viewer.rate.budget_bps <= MAX_BPS
        assert viewer.rate.paused_until_s <= viewer.now_s + 0.5
