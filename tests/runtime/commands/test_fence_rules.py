"""The fence by itself: no thread runs, so each rule is seen alone."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import pytest

from mosaic_core.machines.commands.admission import ArrivedCommand, CommandChannel
from mosaic_core.machines.control.lease_desk import LEASE_EXPIRY_S, LeaseDesk
from mosaic_core.machines.control.lease_events import LeaseChanged, Party, PartyJoined, Reply, Requested
from mosaic_core.machines.control.stop_latch import StopLatch, StopTimes
from mosaic_core.machines.timing.pacing import TokenBucket
from mosaic_core.runtime.commands.fence import SAFE, Fence
from mosaic_core.runtime.commands.safety_watch import SafetyWatch
from mosaic_core.runtime.commands.safety_watchdog import SafetyWatchdog
from mosaic_core.runtime.configuration.receiver_safety import ReceiverSafety

DRIVE = ReceiverSafety(resource="motion")
HORN = ReceiverSafety()
ARM = ReceiverSafety(resource="arm")
TRIMMER = ReceiverSafety(timeout_s=1.0)
ANNA = Party("a", "sa", "Anna", is_person=True)
OLD_PAGE = Party("o", "so", is_original=True)


class Recorder(SafetyWatchdog):
    """Notes which deadlines it is told of; its threads are not started."""

    def __init__(self) -> None:
        super().__init__()
        self.moved: list[float | None] = []

    def deadline_moved(self, due_s: float | None) -> None:
        self.moved.append(due_s)


class Fenced:
    def __init__(self) -> None:
        self.told: list[object] = []
        self.watchdog = Recorder()
        self.desk, self.latch = LeaseDesk(["motion", "arm"], first_epoch=7), StopLatch()
        self.fence = Fence(self.watchdog, self.desk, self.latch, self.told.append)

    def watch(self, safety: ReceiverSafety) -> SafetyWatch:
        return self.watchdog.guard("drive", safety, lambda _: None, lambda _: None)

    def held_by(self, party: Party, now_s: float) -> None:
        self.fence.handle(PartyJoined(party), now_s)
        self.fence.handle(Requested(party.peer_id, "motion"), now_s)


@pytest.fixture
def it() -> Fenced:
    return Fenced()


def test_who_holds_the_lease_may_move_what_it_is_of(it: Fenced) -> None:
    it.held_by(ANNA, 10.0)
    assert it.fence.refusal(DRIVE, "a", 7, 10.0) is None
    assert it.fence.refusal(DRIVE, "a", 6, 10.0) == "lease.old_epoch"
    assert it.fence.refusal(DRIVE, "b", 7, 10.0) == "lease.not_holder"
    assert it.fence.refusal(ARM, "a", 7, 10.0) == "lease.old_epoch"
    assert it.fence.refusal(DRIVE, "a", 7, 10.0 + LEASE_EXPIRY_S) == "lease.expired"


def test_resources_that_come_later_are_leased_too_and_the_new_ones_are_told(it: Fenced) -> None:
    assert it.fence.add_resources(["motion", "lamp"]) == ("lamp",)
    assert it.desk.resources == ("motion", "arm", "lamp")


def arrived(channel: CommandChannel, **how: Any) -> ArrivedCommand:
    anna = ArrivedCommand(channel, "a", "operator", is_ours=True, epoch=7, now_s=10.0)
    return replace(anna, **how)


def test_a_channel_is_measured_by_the_receiver_the_leases_the_stop_and_its_own_bounds(it: Fenced) -> None:
    it.held_by(ANNA, 10.0)
    channel = it.fence.channel(DRIVE, "observe", 0.5, TokenBucket(1.0, 1.0))

    def gate(**how: Any) -> str | None:
        refusal = it.fence.refusal_on_arrival(arrived(channel, **how))
        return None if refusal is None else refusal.gate

    assert gate() is None
    assert gate() == "rate", "one a second"
    assert gate(is_ours=False, now_s=12.0) == "origin"
    assert gate(peer_id="b", now_s=12.0) == "lease"
    assert gate(age_s=0.6, now_s=10.5) == "age"
    assert not it.fence.is_stopped
    it.fence.stop("Anna", "a dog", "id")
    assert it.fence.is_stopped
    assert gate(now_s=11.1) == "stop"


def test_who_has_not_said_hello_commands_where_the_robot_allows_it(it: Fenced) -> None:
    it.held_by(OLD_PAGE, 10.0)
    channel = it.fence.channel(DRIVE, "allow", None, None)
    assert it.fence.refusal_on_arrival(arrived(channel, peer_id="o", is_ours=False, epoch=None)) is None


def test_what_moves_nothing_passes_where_a_drive_does_not(it: Fenced) -> None:
    horn = it.fence.channel(HORN, "allow", None, None)
    it.fence.stop("Anna", "a dog", "id")
    assert it.fence.refusal_on_arrival(arrived(horn, peer_id="b", epoch=None, age_s=1e9)) is None


def test_without_a_time_it_is_now(it: Fenced) -> None:
    it.held_by(ANNA, time.monotonic())
    assert it.fence.refusal(DRIVE, "a", 7) is None
    it.held_by(ANNA, time.monotonic() - 100)
    it.fence.handle(Requested("a", "arm"))
    assert it.desk.deadline_s is not None
    assert it.desk.deadline_s > time.monotonic()


def test_what_moves_without_a_lease_is_only_stopped_and_what_does_not_move_is_free(it: Fenced) -> None:
    for safety, stopped in ((TRIMMER, "safety.stopped"), (DRIVE, "safety.stopped"), (HORN, None)):
        fresh = Fenced()
        fresh.held_by(ANNA, 10.0)
        assert fresh.fence.refusal(safety, "a", 7, 10.0) is None
        fresh.fence.stop("Anna", "a dog", "id")
        assert fresh.fence.refusal(safety, "a", 7, 10.0) == stopped


def test_a_command_keeps_the_lease_and_an_original_page_takes_a_free_one_by_it(it: Fenced) -> None:
    it.fence.handle(PartyJoined(OLD_PAGE), 10.0)
    it.fence.commanded(DRIVE, "o", 11.0)
    assert it.told == [LeaseChanged("motion", OLD_PAGE, 7, "", "o", None)]
    it.fence.commanded(DRIVE, "o", 12.0)
    it.fence.commanded(TRIMMER, "o", 13.0)
    assert it.desk.deadline_s == 12.0 + LEASE_EXPIRY_S


def test_every_effect_is_told_in_its_order_and_the_next_deadline_with_it(it: Fenced) -> None:
    it.held_by(ANNA, 10.0)
    assert it.told == [LeaseChanged("motion", ANNA, 7, "", "Anna", None), Reply("a", "motion", "granted", 7)]
    assert it.watchdog.moved == [None, 10.0 + LEASE_EXPIRY_S]


def test_what_the_lost_lease_moved_is_made_safe_and_nothing_else(it: Fenced) -> None:
    drive, arm, trimmer = it.watch(DRIVE), it.watch(ARM), it.watch(TRIMMER)
    it.held_by(ANNA, 10.0)
    for watch in (drive, arm, trimmer):
        watch.mover = "a"
    assert (drive.generation, len(drive.actions)) == (0, 0), "a lease that was free ends nothing"
    dropped: list[str | None] = []
    drive.dropped = dropped.append
    it.fence.handle(Requested("a", "motion"), 20.0)
    assert (drive.generation, len(drive.actions), dropped) == (1, 1, ["a"])
    assert [(watch.generation, len(watch.actions)) for watch in (arm, trimmer)] == [(0, 0)] * 2


def test_a_stop_says_who_and_why_and_reaches_all_that_moves(it: Fenced) -> None:
    drive, horn = it.watch(DRIVE), it.watch(HORN)
    before_s = time.monotonic()
    is_new, times = it.fence.stop("Anna", "a dog", "id")
    assert (is_new, it.latch.by, it.latch.reason, times.safe_s) == (True, "Anna", "a dog", None)
    assert before_s <= times.received_s <= time.monotonic()
    assert (len(drive.actions), len(horn.actions)) == (1, 0)
    assert it.fence.stop("Ben", "me too", "id") == (False, StopTimes(times.received_s, None))
    assert len(drive.actions) == 1


def test_where_nothing_moves_a_stop_is_safe_at_once(it: Fenced) -> None:
    it.watch(HORN)
    _, times = it.fence.stop("Anna", "", "id")
    assert times.safe_s is not None
    assert times.received_s <= times.safe_s <= time.monotonic()


def test_a_stop_is_safe_when_the_last_safe_action_has_returned_and_that_is_told_once(it: Fenced) -> None:
    drive, arm = it.watch(DRIVE), it.watch(ARM)
    it.fence.made_safe(drive)
    assert it.told == [], "nothing was stopped"
    _, times = it.fence.stop("Anna", "", "id")
    it.fence.made_safe(drive)
    assert (it.told, it.fence.stop("Anna", "", "id")[1].safe_s) == ([], None)
    it.fence.made_safe(arm)
    it.fence.made_safe(arm)
    assert it.told == [SAFE]
    safe_s = it.fence.stop("Anna", "", "id")[1].safe_s
    assert safe_s is not None
    assert times.received_s <= safe_s <= time.monotonic()


def test_a_lease_ends_on_the_safety_threads_clock_to_the_moment(it: Fenced) -> None:
    it.fence.expire(1e9)
    assert (it.told, it.fence.due_at_s) == ([], None), "there is none"
    it.held_by(ANNA, time.monotonic() - 100)
    it.told.clear()
    due_s = it.fence.due_at_s
    assert due_s is not None
    it.fence.expire(due_s - 0.001)
    assert it.told == []
    it.fence.expire(due_s)
    assert it.told[-1] == LeaseChanged("motion", None, 0, "lease.expired", "", ANNA)
    assert it.fence.due_at_s is None


def test_the_watchdog_asks_this_fence_under_the_one_lock(it: Fenced) -> None:
    assert it.watchdog.fence is it.fence
    assert it.fence.lock is it.watchdog.changed
