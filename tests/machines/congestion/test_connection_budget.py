"""One connection is estimated once: whatever its streams are, they share what it carries, pause together, and find
again what was known."""

from __future__ import annotations

import pytest

from mosaic_core.machines.congestion.budget_allocator import DRIVES, Demand
from mosaic_core.machines.congestion.connection_budget import RISE_INTERVAL_S, ConnectionBudget
from mosaic_core.machines.congestion.feedback import BandwidthEstimate, PictureLost, ReceiverReport
from mosaic_core.machines.congestion.path_watch import PathSeen
from mosaic_core.machines.congestion.rate_control import START_BPS
from mosaic_core.machines.congestion.stream_reports import StreamReports

NOW_S = 1e9
"""Later than any cut."""
CAMERA = Demand(100_000, 2_000_000)


def seen(*, lost: int = 0, queue_s: float = 0.0, path_bps: float | None = None, empties_in_s: float = 0.0) -> PathSeen:
    return PathSeen(queue_s, queue_s, NOW_S, 30 - lost, lost, empties_in_s, path_bps, None)


def queued(budget: ConnectionBudget, path_bps: float, now_s: float = 1.0) -> None:
    """Two reports of a queue, at the link that carries ``path_bps``."""
    for step in range(2):
        report = seen(queue_s=0.2, path_bps=path_bps, empties_in_s=0.2)
        budget.handle(None, report, now_s + 0.1 * step)


def watched(*streams: str, demand: Demand = CAMERA) -> ConnectionBudget:
    budget = ConnectionBudget(0.0)
    for stream in streams:
        budget.want(stream, demand)
    return budget


def test_nothing_is_wanted_and_nobody_has_a_part() -> None:
    budget = ConnectionBudget(0.0)
    assert budget.parts == {}
    assert budget.part_bps("front") == 0
    assert not budget.wants_copy(1000, 1.0)


def test_one_stream_begins_with_everything_and_two_share_it() -> None:
    budget = watched("front")
    assert budget.part_bps("front") == START_BPS
    budget.want("rear", CAMERA)
    assert budget.part_bps("front") == budget.part_bps("rear") == START_BPS // 2
    budget.want_nothing("front")
    assert (budget.part_bps("front"), budget.part_bps("rear")) == (0, START_BPS)


def test_a_queue_is_one_for_all_of_them_and_they_share_what_came_through() -> None:
    budget = watched("front", "rear")
    queued(budget, 1_000_000)
    assert sum(budget.parts.values()) == budget.budget_bps == 800_000
    assert budget.paused_until_s > 1.1
    assert budget.pace(0, 0, 1.11) == pytest.approx(budget.paused_until_s - 1.11), "nobody's packet leaves meanwhile"
    assert budget.pace(0, 0, budget.paused_until_s) == 0.0


def test_what_drives_keeps_its_part_when_the_link_gets_narrow() -> None:
    budget = ConnectionBudget(0.0)
    budget.want("front", Demand(100_000, 400_000, DRIVES))
    budget.want("rear", CAMERA)
    queued(budget, 500_000)
    assert budget.parts == {"front": 300_000, "rear": 100_000}
    assert sum(budget.parts.values()) == budget.budget_bps


def test_who_comes_later_begins_with_what_is_known_of_the_path() -> None:
    budget = watched("front")
    queued(budget, 300_000)
    known_bps = budget.budget_bps
    budget.want_nothing("front")
    budget.want("rear", CAMERA)
    assert budget.part_bps("rear") == known_bps < START_BPS


def test_arrivals_bring_a_better_controller_which_begins_where_the_simple_one_stood() -> None:
    budget = watched("front")
    budget.handle("front", BandwidthEstimate(200_000), 0.5)
    before_bps = budget.budget_bps
    budget.handle(None, seen(), 1.0)
    assert budget.budget_bps == pytest.approx(before_bps, rel=0.2)
    budget.handle("front", ReceiverReport(0, 10, 0.07), 1.1)
    assert budget.round_trip_s == 0.07
    budget.handle("front", PictureLost(), 1.2)
    assert budget.budget_bps == pytest.approx(before_bps, rel=0.2), "what the simple one needs says nothing to it"


def test_without_arrivals_silence_costs_all_streams() -> None:
    budget = watched("front", "rear")
    for step in range(20):
        budget.sent(10_000, 1.0 + 0.25 * step)
    budget.tick(6.5)
    assert sum(budget.parts.values()) == budget.budget_bps < START_BPS


@pytest.mark.parametrize("has_arrivals", [False, True])
def test_who_was_not_sent_anything_for_long_is_no_silence(has_arrivals: bool) -> None:
    budget = watched("front")
    if has_arrivals:
        budget.handle(None, seen(), 0.1)
    before_bps = budget.budget_bps
    for step in range(3):
        budget.sent(1_000, 30.0 + 0.2 * step)
    budget.tick(30.5)
    assert budget.budget_bps == before_bps
    for step in range(30):
        budget.sent(1_000, 30.6 + 0.2 * step)
    budget.tick(36.5)
    assert budget.budget_bps < before_bps, "but nothing heard of what was sent is"


def test_under_a_ceiling_of_the_user_much_loss_makes_room_for_copies_within_it() -> None:
    budget = ConnectionBudget(0.0)
    budget.want("front", Demand(400_000, 400_000), 400_000)
    budget.want("rear", CAMERA)
    budget.handle(None, seen(), 1.0)
    assert budget.picture_bps("front", 1.0) == 400_000
    for step in range(10):
        budget.handle(None, seen(lost=1), 1.1 + 0.1 * step)
    assert budget.picture_bps("front", 2.1) == 200_000
    assert budget.doubles_repeats


def test_large_pictures_of_two_streams_wait_for_one_pace() -> None:
    budget = watched("front", "rear")
    waits_s = [budget.pace(1200, 0, 1.0) for _ in range(20)]
    assert waits_s[0] == 0.0
    assert waits_s[-1] > 0.0
    assert budget.pace(0, 0, 1.0) > 0.0
    assert budget.pace(0, 0, 2.0) == 0.0


def test_reports_of_several_streams_are_as_if_they_were_of_one() -> None:
    reports = StreamReports()
    assert reports.merged("front", ReceiverReport(5, 1000)) == ReceiverReport(0, 0), "its beginning is not known"
    assert reports.merged("rear", ReceiverReport(7, 5000, 0.1)) == ReceiverReport(0, 0, 0.1)
    assert reports.merged("front", ReceiverReport(8, 1100)) == ReceiverReport(3, 100)
    assert reports.merged("rear", ReceiverReport(9, 5050)) == ReceiverReport(5, 150)


def test_streams_begin_better_pictures_one_after_the_other() -> None:
    budget = ConnectionBudget(0.0)
    assert budget.may_rise(0.0)
    assert not budget.may_rise(RISE_INTERVAL_S - 0.01)
    assert budget.may_rise(RISE_INTERVAL_S)
    assert not budget.may_rise(RISE_INTERVAL_S + 0.5)


@pytest.mark.parametrize("hears_arrivals", [True, False])
def test_sound_alone_does_not_make_the_pictures_that_come_later_begin_small(hears_arrivals: bool) -> None:
    budget = watched("ears", demand=Demand(48_000, 48_000, DRIVES))
    if hears_arrivals:
        budget.handle(None, seen(), 1.0)
    assert budget.parts == {"ears": 48_000}
    budget.want("front", CAMERA)
    assert budget.parts == {"ears": 48_000, "front": START_BPS - 48_000}


def data(budget: ConnectionBudget, bps: float, from_s: float, seconds: float = 1.0) -> None:
    """A sensor, fifty times a second."""
    for step in range(round(50 * seconds)):
        budget.data_left(round(bps / 8 / 50), from_s + step / 50)


def test_ordinary_data_is_taken_off_what_pictures_may_send_and_given_back_when_it_ends() -> None:
    budget = watched("front")
    queued(budget, 1_000_000)
    data(budget, 200_000, 2.0)
    budget.tick(2.99)
    assert budget.budget_bps == 800_000, "the path takes what it took"
    assert budget.part_bps("front") == pytest.approx(600_000, abs=10_000)
    budget.tick(4.5)
    assert (budget.budget_bps, budget.part_bps("front")) == (800_000, 800_000)


def test_what_came_through_of_the_pictures_is_less_than_the_path_takes_by_the_data() -> None:
    budget = watched("front")
    data(budget, 200_000, 0.0)
    queued(budget, 600_000, 0.9)
    assert budget.budget_bps == pytest.approx(0.8 * 800_000, abs=10_000)
    assert budget.part_bps("front") == pytest.approx(0.8 * 800_000 - 200_000, abs=10_000)


def test_data_is_no_stranger_on_the_link() -> None:
    """Half of a link that data of our own has the other half of is all of it."""
    budget = watched("front")
    data(budget, 400_000, 0.0)
    for step in range(2):
        budget.handle(None, PathSeen(0.2, 0.2, NOW_S, 30, 0, 0.2, 400_000, 800_000, 0.5), 0.9 + 0.1 * step)
    assert budget.budget_bps == pytest.approx(640_000, abs=20_000)
    for step in range(40):
        for _ in range(6):
            budget.sent(1_000, 1.5 + 0.1 * step)
        data(budget, 400_000, 1.5 + 0.1 * step, 0.1)
        budget.handle(None, PathSeen(0.0, 0.0, NOW_S, 30, 0, 0.0, None, 1_600_000), 1.5 + 0.1 * step)
    assert budget.budget_bps > 1_100_000, "a link that has become twice as fast is not half a stranger's"


@pytest.mark.parametrize("has_arrivals", [True, False])
def test_on_a_path_that_takes_more_than_is_wanted_data_costs_pictures_nothing(has_arrivals: bool) -> None:
    budget = watched("front", demand=Demand(100_000, 700_000))
    if has_arrivals:
        budget.handle(None, seen(), 1.0)
    data(budget, 300_000, 1.0)
    budget.tick(1.99)
    assert budget.part_bps("front") == 700_000
    budget.tick(4.0)
    assert budget.part_bps("front") == budget.budget_bps == 700_000


def test_pictures_keep_half_whatever_data_is_sent() -> None:
    budget = watched("front")
    queued(budget, 1_000_000)
    data(budget, 5_000_000, 2.0)
    budget.tick(2.99)
    assert budget.part_bps("front") == pytest.approx(400_000, rel=0.01)


def test_a_receivers_estimate_is_of_pictures_alone() -> None:
    budget = watched("front")
    data(budget, 200_000, 0.0)
    for step in range(20):
        budget.sent(3_500, 0.05 * step)
    budget.handle("front", BandwidthEstimate(560_000), 0.98)
    budget.handle("front", PictureLost(), 0.98)
    budget.handle("front", PictureLost(), 0.98)
    budget.handle("front", PictureLost(), 0.99)
    assert budget.budget_bps == pytest.approx(0.75 * 760_000, rel=0.02)


def test_copies_are_sent_beside_data_only_where_the_path_takes_both() -> None:
    def copies(data_bps: float) -> int:
        budget = watched("front", demand=Demand(100_000, 400_000))
        data(budget, data_bps, 0.0, 3.0)
        for step in range(20):
            budget.handle(None, PathSeen(0.0, 0.0, NOW_S, 29, 1, 0.0, None, 1_000_000), 1.0 + 0.1 * step)
        return sum(budget.wants_copy(1200, 2.9 + 0.01 * step) for step in range(20))

    assert copies(400_000) < copies(0)
