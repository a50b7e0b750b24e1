"""One holder per resource, and the lease changes hands only by the rules."""

from __future__ import annotations

import pickle
from collections import deque
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mosaic_core.machines.control.lease_desk import EPOCH_MAX, MAX_PEERS, LeaseDesk
from mosaic_core.machines.control.lease_events import (
    Commanded,
    DeadlinePassed,
    Effect,
    Event,
    Kept,
    LeaseChanged,
    LegacyPeers,
    Party,
    PartyJoined,
    PartyLeft,
    QueueChanged,
    Released,
    Reply,
    RequestAnswered,
    Requested,
)
from mosaic_core.machines.control.lease_queue import MAX_WAITING
from mosaic_core.words.codes import REASONS
from mosaic_core.words.control import Role

ANNA = Party("a", "sa", "Anna", is_person=True)
BEN = Party("b", "sb", "Ben", is_person=True)
PATROL = Party("p", "sp", "patrol")
MAPPER = Party("m", "sm", "mapper")
CHIEF = Party("c", "sc", "Chief", role="supervisor", is_person=True)
WATCHER = Party("w", "sw", "Walt", role="observer", is_person=True)
OLD_DASHBOARD = Party("o", "so", is_original=True)


def desk_with(*parties: Party, holder: Party | None = None, legacy: LegacyPeers = "allow") -> LeaseDesk:
    desk = LeaseDesk(["motion", "arm"], first_epoch=100, legacy=legacy)
    for party in parties:
        assert desk.handle(PartyJoined(party), 0.0) == []
    if holder is not None:
        desk.handle(Requested(holder.peer_id, "motion"), 0.0)
        assert desk.holder("motion") == holder
    return desk


def replies(effects: list[Effect]) -> list[tuple[str, str, str]]:
    return [(one.peer_id, one.outcome, one.code) for one in effects if isinstance(one, Reply)]


def change(effects: list[Effect]) -> LeaseChanged:
    [one] = [effect for effect in effects if isinstance(effect, LeaseChanged)]
    return one


# -- asking


def test_a_free_lease_is_granted_with_an_epoch() -> None:
    desk = desk_with(ANNA)
    assert desk.epoch("motion") == 0
    assert desk.handle(Requested("a", "motion"), 1.0) == [
        LeaseChanged("motion", ANNA, 100, "", "Anna", None),
        Reply("a", "motion", "granted", 100),
    ]
    assert (desk.holder("motion"), desk.epoch("motion"), desk.deadline_s) == (ANNA, 100, 3.0)


def test_every_grant_of_any_resource_has_an_epoch_of_its_own() -> None:
    desk = desk_with(ANNA)
    desk.handle(Requested("a", "motion"), 0.0)
    desk.handle(Requested("a", "arm"), 0.0)
    assert (desk.epoch("motion"), desk.epoch("arm")) == (100, 101)
    assert desk.refusal("a", "arm", 100, 0.1) == "lease.old_epoch"


def test_asking_for_what_one_holds_keeps_the_epoch_and_is_a_sign_of_life() -> None:
    desk = desk_with(ANNA, holder=ANNA)
    assert desk.handle(Requested("a", "motion"), 1.5) == [Reply("a", "motion", "granted", 100)]
    assert desk.deadline_s == 3.5


def test_a_person_takes_from_a_program_at_once() -> None:
    desk = desk_with(PATROL, ANNA, holder=PATROL)
    effects = desk.handle(Requested("a", "motion", "a child on the way"), 1.0)
    assert effects == [
        Reply("p", "motion", "ended", 0, "lease.preempted", "a child on the way"),
        LeaseChanged("motion", ANNA, 101, "lease.preempted", "Anna", PATROL, "a child on the way"),
        Reply("a", "motion", "granted", 101),
    ]


def test_a_program_takes_nothing_from_a_person_and_does_not_wait() -> None:
    desk = desk_with(PATROL, ANNA, holder=ANNA)
    assert desk.handle(Requested("p", "motion"), 1.0) == [Reply("p", "motion", "denied", 0, "lease.person_commands")]
    assert desk.queue("motion") == ()


def test_not_even_by_force_a_program_takes_from_a_person() -> None:
    robot_chief = Party("rc", "src", "night watch", role="supervisor")
    desk = desk_with(robot_chief, ANNA, holder=ANNA)
    effects = desk.handle(Requested("rc", "motion", "schedule", force=True), 1.0)
    assert replies(effects) == [("rc", "denied", "lease.person_commands")]


def test_a_person_waits_for_a_person_who_sees_it() -> None:
    desk = desk_with(ANNA, BEN, holder=ANNA)
    effects = desk.handle(Requested("b", "motion", "my turn"), 1.0)
    assert effects == [Reply("b", "motion", "queued", 0, "lease.queued"), QueueChanged("motion")]
    [waiting] = desk.queue("motion")
    assert (waiting.party, waiting.reason) == (BEN, "my turn")


def test_a_program_waits_for_a_program() -> None:
    desk = desk_with(PATROL, MAPPER, holder=PATROL)
    assert replies(desk.handle(Requested("m", "motion"), 1.0)) == [("m", "queued", "lease.queued")]


def test_an_observer_gets_no_lease() -> None:
    desk = desk_with(WATCHER)
    assert desk.handle(Requested("w", "motion"), 1.0) == [Reply("w", "motion", "denied", 0, "lease.forbidden")]
    assert desk.refusal("w", "motion", 0, 1.0) == "lease.forbidden"


@pytest.mark.parametrize(("party", "reason"), [(BEN, "because"), (CHIEF, ""), (CHIEF, "  \t")])
def test_force_is_for_supervisors_with_a_reason(party: Party, reason: str) -> None:
    desk = desk_with(ANNA, party, holder=ANNA)
    effects = desk.handle(Requested(party.peer_id, "motion", reason, force=True), 1.0)
    assert effects == [Reply(party.peer_id, "motion", "denied", 0, "lease.force_forbidden")]
    assert desk.holder("motion") == ANNA


def test_a_supervisor_takes_over_and_the_old_holder_hears_why() -> None:
    desk = desk_with(ANNA, CHIEF, holder=ANNA)
    effects = desk.handle(Requested("c", "motion", "smoke in hall 2", force=True), 1.0)
    assert effects == [
        Reply("a", "motion", "ended", 0, "lease.taken_over", "smoke in hall 2"),
        LeaseChanged("motion", CHIEF, 101, "lease.taken_over", "Chief", ANNA, "smoke in hall 2"),
        Reply("c", "motion", "granted", 101),
    ]


def test_force_is_told_as_force_also_where_it_was_not_needed() -> None:
    desk = desk_with(PATROL, CHIEF, holder=PATROL)
    effects = desk.handle(Requested("c", "motion", "smoke in hall 2", force=True), 1.0)
    assert change(effects).cause == "lease.taken_over"


def test_an_unknown_resource_is_named() -> None:
    desk = desk_with(ANNA)
    denied = Reply("a", "legs", "denied", 0, "lease.unknown_resource")
    assert desk.handle(Requested("a", "legs"), 0.0) == [denied]
    assert desk.handle(Released("a", "legs"), 0.0) == [denied]
    assert desk.refusal("a", "legs", 1, 0.0) == "lease.unknown_resource"
    assert (desk.holder("legs"), desk.epoch("legs"), desk.queue("legs")) == (None, 0, ())


# -- the queue


def test_persons_come_before_programs_and_then_who_came_first() -> None:
    desk = desk_with(PATROL, MAPPER, ANNA, BEN, CHIEF, holder=PATROL)
    desk.handle(Requested("m", "motion"), 0.1)
    desk.handle(Requested("a", "motion"), 0.2)  # takes it from the program
    desk.handle(Requested("b", "motion"), 0.3)
    desk.handle(Requested("c", "motion"), 0.4)
    assert [one.party for one in desk.queue("motion")] == [BEN, CHIEF, MAPPER]


def test_when_the_holder_releases_the_first_in_the_queue_has_it() -> None:
    desk = desk_with(ANNA, BEN, holder=ANNA)
    desk.handle(Requested("b", "motion"), 0.5)
    assert desk.handle(Released("a", "motion"), 1.0) == [
        Reply("a", "motion", "ended", 0, "lease.released"),
        LeaseChanged("motion", BEN, 101, "lease.released", "Anna", ANNA),
        Reply("b", "motion", "granted", 101),
    ]
    assert desk.queue("motion") == ()


def test_of_two_who_wait_the_first_has_it_next() -> None:
    desk = desk_with(ANNA, BEN, CHIEF, holder=ANNA)
    desk.handle(Requested("b", "motion"), 0.1)
    desk.handle(Requested("c", "motion"), 0.2)
    desk.handle(Released("a", "motion"), 0.3)
    assert (desk.holder("motion"), [one.party for one in desk.queue("motion")]) == (BEN, [CHIEF])


def test_an_answer_that_grants_nothing_names_no_epoch() -> None:
    assert Reply("a", "motion", "denied").epoch == 0


def test_a_session_stands_in_a_queue_once_and_keeps_its_place() -> None:
    desk = desk_with(ANNA, BEN, CHIEF, holder=ANNA)
    desk.handle(Requested("b", "motion", "first"), 0.1)
    desk.handle(Requested("c", "motion"), 0.2)
    desk.handle(Requested("b", "motion", "again"), 0.3)
    assert [(one.party, one.reason) for one in desk.queue("motion")] == [(BEN, "again"), (CHIEF, "")]


def test_who_waits_may_stop_waiting() -> None:
    desk = desk_with(ANNA, BEN, holder=ANNA)
    desk.handle(Requested("b", "motion"), 0.1)
    told = [Reply("b", "motion", "ended", 0, "lease.released")]
    assert desk.handle(Released("b", "motion"), 0.2) == [*told, QueueChanged("motion")]
    assert desk.handle(Released("b", "motion"), 0.3) == told, "again: nothing changes, but it is answered"
    assert desk.holder("motion") == ANNA


@pytest.mark.parametrize("on_purpose", [True, False])
def test_who_leaves_waits_no_longer(on_purpose: bool) -> None:
    desk = desk_with(ANNA, BEN, holder=ANNA)
    desk.handle(Requested("b", "motion"), 0.1)
    assert desk.handle(PartyLeft("b", on_purpose), 0.2) == [QueueChanged("motion")]
    assert change(desk.handle(Released("a", "motion"), 0.3)).holder is None


def test_the_queue_is_bounded_and_a_program_makes_room_for_a_person() -> None:
    programs = [Party(f"p{number}", f"sp{number}") for number in range(MAX_WAITING)]
    desk = desk_with(ANNA, BEN, PATROL, MAPPER, *programs, holder=PATROL)
    for number, program in enumerate(programs):
        desk.handle(Requested(program.peer_id, "motion"), 0.001 * number)
    denied = Reply("m", "motion", "denied", 0, "lease.denied", "too many wait already")
    assert desk.handle(Requested("m", "motion"), 0.5) == [denied]
    desk.handle(Requested("a", "motion"), 0.6)
    effects = desk.handle(Requested("b", "motion"), 0.7)
    assert effects == [
        Reply("p31", "motion", "denied", 0, "lease.person_commands"),
        Reply("b", "motion", "queued", 0, "lease.queued"),
        QueueChanged("motion"),
    ]
    assert len(desk.queue("motion")) == MAX_WAITING
    assert desk.queue("motion")[0].party == BEN


# -- answers


def test_the_holder_hands_over() -> None:
    desk = desk_with(ANNA, BEN, CHIEF, holder=ANNA)
    desk.handle(Requested("b", "motion"), 0.1)
    desk.handle(Requested("c", "motion"), 0.2)
    effects = desk.handle(RequestAnswered("a", "motion", "c", True, "yours"), 0.3)
    assert replies(effects) == [("a", "ended", "lease.handed_over"), ("c", "granted", "")]
    assert change(effects) == LeaseChanged("motion", CHIEF, 101, "lease.handed_over", "Anna", ANNA, "yours")
    assert [one.party for one in desk.queue("motion")] == [BEN]


def test_the_holder_refuses_with_a_word() -> None:
    desk = desk_with(ANNA, BEN, holder=ANNA)
    desk.handle(Requested("b", "motion"), 0.1)
    effects = desk.handle(RequestAnswered("a", "motion", "b", False, "one minute"), 0.3)
    assert effects == [Reply("b", "motion", "denied", 0, "lease.denied", "one minute"), QueueChanged("motion")]
    assert desk.queue("motion") == ()


@pytest.mark.parametrize(
    "answer",
    [
        RequestAnswered("b", "motion", "b", True),
        RequestAnswered("a", "motion", "c", True),
        RequestAnswered("a", "arm", "b", True),
    ],
)
def test_an_answer_counts_only_from_the_holder_to_somebody_who_waits(answer: RequestAnswered) -> None:
    desk = desk_with(ANNA, BEN, CHIEF, holder=ANNA)
    desk.handle(Requested("b", "motion"), 0.1)
    assert desk.handle(answer, 0.3) == []
    assert desk.holder("motion") == ANNA


# -- time


def test_a_silent_holder_loses_the_lease_exactly_when_its_time_is_over() -> None:
    desk = desk_with(ANNA, holder=ANNA)
    assert desk.deadline_s == 2.0
    assert desk.handle(DeadlinePassed(), 1.999) == []
    assert desk.handle(DeadlinePassed(), 2.0) == [
        Reply("a", "motion", "ended", 0, "lease.expired"),
        LeaseChanged("motion", None, 0, "lease.expired", "", ANNA),
    ]
    assert desk.deadline_s is None


@pytest.mark.parametrize("sign", [Kept("a", {"motion": 100}), Commanded("a", "motion"), Requested("a", "motion")])
def test_a_sign_of_life_keeps_a_lease(sign: Event) -> None:
    desk = desk_with(ANNA, holder=ANNA)
    desk.handle(sign, 1.5)
    assert desk.deadline_s == 3.5
    desk.handle(sign, 1.0)
    assert desk.deadline_s == 3.5, "a clock that goes back takes nothing"


@pytest.mark.parametrize(
    "sign",
    [
        Kept("a", {"motion": 99, "arm": 100, "x": 100}),
        Kept("b", {"motion": 100}),
        Commanded("b", "motion"),
        Kept("a", {}),
    ],
)
def test_what_is_no_sign_of_life_of_the_holder_keeps_nothing(sign: Event) -> None:
    desk = desk_with(ANNA, BEN, holder=ANNA)
    assert desk.handle(sign, 1.5) == []
    assert desk.deadline_s == 2.0


def test_an_expired_lease_admits_nothing_even_before_anybody_noticed() -> None:
    desk = desk_with(ANNA, BEN, holder=ANNA)
    assert desk.refusal("a", "motion", 100, 1.999) is None
    assert desk.refusal("a", "motion", 100, 2.0) == "lease.expired"
    assert desk.holds_any("a", 1.999)
    assert not desk.holds_any("a", 2.0)


def test_a_keep_alive_that_comes_too_late_revives_nothing() -> None:
    desk = desk_with(ANNA, BEN, holder=ANNA)
    desk.handle(Requested("b", "motion"), 1.0)
    effects = desk.handle(Kept("a", {"motion": 100}), 2.5)
    assert replies(effects) == [("a", "ended", "lease.expired"), ("b", "granted", "")]


def test_of_two_leases_the_one_that_ends_first_is_waited_for() -> None:
    desk = desk_with(ANNA, holder=ANNA)
    desk.handle(Requested("a", "arm"), 1.0)
    assert desk.deadline_s == 2.0


def test_how_long_a_lease_lasts_unkept_is_known() -> None:
    desk = LeaseDesk(["motion"], expiry_s=0.5)
    desk.handle(PartyJoined(ANNA), 0.0)
    desk.handle(Requested("a", "motion"), 0.0)
    assert (desk.expiry_s, desk.deadline_s) == (0.5, 0.5)


# -- coming and going


def test_a_holder_that_says_bye_holds_nothing() -> None:
    desk = desk_with(ANNA, holder=ANNA)
    assert desk.handle(PartyLeft("a", on_purpose=True), 0.5) == [
        LeaseChanged("motion", None, 0, "lease.peer_left", "Anna", ANNA),
    ]


def test_a_lost_holder_has_until_the_expiry_to_come_back_with_a_new_epoch() -> None:
    desk = desk_with(ANNA, BEN, holder=ANNA)
    assert desk.handle(PartyLeft("a", on_purpose=False), 0.5) == []
    again = Party("a2", "sa", "Anna", is_person=True)
    desk.handle(PartyJoined(again), 1.0)
    assert desk.refusal("a2", "motion", 100, 1.1) == "lease.not_holder", "it has to ask"
    assert desk.handle(Requested("a2", "motion"), 1.2) == [
        LeaseChanged("motion", again, 101, "peer.replaced", "Anna", ANNA),
        Reply("a2", "motion", "granted", 101),
    ]
    assert desk.refusal("a", "motion", 100, 1.3) == "lease.not_holder"
    assert desk.deadline_s == 3.2, "with a whole term before it"


def test_a_lost_holder_that_comes_back_under_its_own_peer_id_goes_on() -> None:
    desk = desk_with(ANNA, holder=ANNA)
    desk.handle(PartyLeft("a", on_purpose=False), 0.5)
    assert desk.handle(PartyJoined(ANNA), 1.0) == []
    assert desk.refusal("a", "motion", 100, 1.1) is None


def test_a_holder_that_says_more_of_itself_goes_on_and_is_known_by_it() -> None:
    desk = desk_with(PATROL, holder=PATROL)
    named = Party("p", "sp", "Pia", is_person=True)
    assert desk.handle(PartyJoined(named), 0.5) == []
    assert (desk.holder("motion"), desk.epoch("motion")) == (named, 100)


def test_who_gets_what_another_may_no_longer_have_has_it_for_a_whole_term() -> None:
    desk = desk_with(ANNA, BEN, holder=ANNA)
    desk.handle(Requested("b", "motion"), 0.1)
    desk.handle(PartyJoined(Party("a", "sa", "Anna", role="observer", is_person=True)), 0.5)
    assert (desk.holder("motion"), desk.deadline_s) == (BEN, 2.5)


def test_a_lost_holder_that_does_not_come_back_makes_way_for_who_waits() -> None:
    desk = desk_with(ANNA, BEN, holder=ANNA)
    desk.handle(PartyLeft("a", on_purpose=False), 0.5)
    desk.handle(Requested("b", "motion"), 0.6)
    effects = desk.handle(DeadlinePassed(), 2.0)
    assert replies(effects) == [("b", "granted", "")], "nothing is said to somebody who is gone"


def test_a_lost_holder_whose_session_says_bye_later_holds_nothing() -> None:
    desk = desk_with(ANNA, holder=ANNA)
    desk.handle(PartyLeft("a", on_purpose=False), 0.5)
    assert change(desk.handle(PartyLeft("a", on_purpose=True), 0.6)).cause == "lease.peer_left"


def test_a_session_may_release_from_its_new_peer_connection() -> None:
    desk = desk_with(ANNA, Party("a2", "sa", "Anna", is_person=True), holder=ANNA)
    effects = desk.handle(Released("a2", "motion"), 0.5)
    assert ("a2", "ended", "lease.released") in replies(effects)
    assert desk.holder("motion") is None


def test_an_empty_session_belongs_to_nobody_else() -> None:
    nameless, other = Party("x", ""), Party("y", "")
    desk = desk_with(nameless, other, holder=nameless)
    assert replies(desk.handle(Requested("y", "motion"), 0.5)) == [("y", "queued", "lease.queued")]


def test_a_stranger_with_the_peer_id_of_a_lost_holder_inherits_nothing() -> None:
    desk = desk_with(ANNA, holder=ANNA)
    desk.handle(PartyLeft("a", on_purpose=False), 0.5)
    effects = desk.handle(PartyJoined(Party("a", "somebody else")), 0.6)
    assert change(effects).holder is None
    assert desk.refusal("a", "motion", 100, 0.7) == "lease.old_epoch"


def test_a_peer_that_becomes_another_session_keeps_nothing_of_the_old_one() -> None:
    desk = desk_with(ANNA, BEN, holder=ANNA)
    desk.handle(Requested("b", "motion"), 0.1)
    assert desk.handle(PartyJoined(Party("b", "another", is_person=True)), 0.2) == [QueueChanged("motion")]
    assert change(desk.handle(PartyJoined(Party("a", "another", is_person=True)), 0.3)).holder is None


def test_a_lost_holder_without_a_session_cannot_be_told_from_a_stranger() -> None:
    desk = desk_with(Party("x", ""), holder=Party("x", ""))
    desk.handle(PartyLeft("x", on_purpose=False), 0.5)
    assert change(desk.handle(PartyJoined(Party("x", "")), 0.6)).holder is None


def test_a_peer_without_an_id_is_nobody() -> None:
    desk = desk_with(Party("", "s", "Nobody", role="supervisor", is_person=True))
    assert desk.handle(Requested("", "motion"), 0.1) == []
    assert desk.refusal("", "motion", 0, 0.1) == "lease.required"


def test_who_waits_and_says_again_who_it_is_changes_nothing() -> None:
    desk = desk_with(ANNA, BEN, holder=ANNA)
    desk.handle(Requested("b", "motion"), 0.1)
    assert desk.handle(PartyJoined(BEN), 0.2) == []


def test_who_becomes_an_observer_loses_its_lease() -> None:
    desk = desk_with(ANNA, holder=ANNA)
    effects = desk.handle(PartyJoined(Party("a", "sa", "Anna", role="observer", is_person=True)), 0.5)
    assert change(effects).holder is None
    assert desk.refusal("a", "motion", 100, 0.6) == "lease.forbidden"


def test_a_late_word_of_being_a_person_counts_in_the_queue() -> None:
    desk = desk_with(PATROL, MAPPER, BEN, holder=PATROL)
    desk.handle(Requested("m", "motion"), 0.1)
    desk.handle(Requested("b", "motion"), 0.2)
    anna = Party("a", "sa", "Anna")
    desk.handle(PartyJoined(anna), 0.3)
    assert desk.handle(PartyJoined(anna), 0.3) == [], "twice the same is nothing new"
    desk.handle(Requested("a", "motion"), 0.4)
    assert [one.party.peer_id for one in desk.queue("motion")] == ["m"], "a person commands: a program is denied"
    assert desk.handle(PartyJoined(Party("m", "sm", "Mia", is_person=True)), 0.5) == [QueueChanged("motion")]
    assert desk.queue("motion")[0].party.is_person


def test_more_peers_than_a_robot_ever_has_are_strangers() -> None:
    desk = LeaseDesk(["motion"])
    for number in range(MAX_PEERS + 50):
        desk.handle(PartyJoined(Party(f"p{number}", "")), 0.0)
    assert desk.party(f"p{MAX_PEERS - 1}") is not None
    assert desk.handle(Requested(f"p{MAX_PEERS}", "motion"), 0.1) == []
    assert desk.refusal(f"p{MAX_PEERS}", "motion", 0, 0.1) == "lease.required"


# -- commands


def test_a_command_needs_the_holders_peer_and_the_present_epoch() -> None:
    desk = desk_with(ANNA, BEN, holder=ANNA)
    assert desk.refusal("a", "motion", 100, 1.0) is None
    assert desk.refusal("a", "motion", 99, 1.0) == "lease.old_epoch"
    assert desk.refusal("a", "motion", 0, 1.0) == "lease.required"
    assert desk.refusal("a", "motion", None, 1.0) == "lease.required", "a bare channel carries no epoch"
    assert desk.refusal("b", "motion", 100, 1.0) == "lease.not_holder"
    assert desk.refusal("nobody", "motion", 100, 1.0) == "lease.not_holder"
    assert desk.refusal("a", "arm", 0, 1.0) == "lease.required"


def test_an_original_peer_takes_a_free_lease_by_commanding() -> None:
    desk = desk_with(OLD_DASHBOARD, PATROL)
    assert desk.refusal("o", "motion", None, 0.0) is None
    assert desk.handle(Commanded("o", "motion"), 0.0) == [LeaseChanged("motion", OLD_DASHBOARD, 100, "", "o", None)]
    assert desk.refusal("o", "motion", None, 1.0) is None
    desk.handle(Commanded("o", "motion"), 1.0)
    assert desk.deadline_s == 3.0
    assert desk.refusal("p", "motion", 100, 1.0) == "lease.not_holder"
    assert change(desk.handle(DeadlinePassed(), 3.0)).cause == "lease.expired"


def test_an_original_peer_never_takes_what_somebody_holds() -> None:
    desk = desk_with(OLD_DASHBOARD, ANNA, holder=ANNA)
    assert desk.refusal("o", "motion", None, 1.0) == "lease.not_holder"
    assert desk.handle(Commanded("o", "motion"), 1.0) == []
    assert desk.holder("motion") == ANNA


def test_an_original_peer_does_not_jump_the_queue() -> None:
    desk = desk_with(OLD_DASHBOARD, ANNA, BEN, holder=ANNA)
    desk.handle(Requested("b", "motion"), 1.0)
    assert desk.refusal("o", "motion", None, 2.5) == "lease.required", "Anna's time is over, and it is Ben's turn"


def test_a_person_takes_from_an_original_peer_which_hears_nothing() -> None:
    desk = desk_with(OLD_DASHBOARD, ANNA)
    desk.handle(Commanded("o", "motion"), 0.0)
    assert replies(desk.handle(Requested("a", "motion"), 0.5)) == [("a", "granted", "")]


@pytest.mark.parametrize("event", [Requested("o", "motion"), Released("o", "motion")])
def test_an_original_peer_asks_for_nothing(event: Event) -> None:
    assert desk_with(OLD_DASHBOARD).handle(event, 0.0) == []


@pytest.mark.parametrize("legacy", ["observe", "refuse"])
def test_where_originals_only_observe_their_commands_are_refused(legacy: LegacyPeers) -> None:
    desk = desk_with(OLD_DASHBOARD, legacy=legacy)
    assert desk.refusal("o", "motion", None, 0.0) == "lease.original_observes"
    assert desk.handle(Commanded("o", "motion"), 0.0) == []


# -- epochs


def test_an_epoch_is_never_zero_even_after_the_last_one() -> None:
    desk = LeaseDesk(["motion"], first_epoch=EPOCH_MAX - 1)
    desk.handle(PartyJoined(ANNA), 0.0)
    epochs = []
    for _ in range(4):
        desk.handle(Requested("a", "motion"), 0.0)
        epochs.append(desk.epoch("motion"))
        desk.handle(Released("a", "motion"), 0.0)
    assert epochs == [EPOCH_MAX - 1, EPOCH_MAX, 1, 2]


@pytest.mark.parametrize("options", [{}, {"first_epoch": 0}, {"first_epoch": EPOCH_MAX}])
def test_epochs_begin_with_one_where_nothing_else_is_said(options: dict[str, int]) -> None:
    desk = LeaseDesk(["motion"], **options)  # type: ignore[arg-type]
    desk.handle(PartyJoined(ANNA), 0.0)
    desk.handle(Requested("a", "motion"), 0.0)
    assert desk.epoch("motion") == 1


@pytest.mark.parametrize("first", [0, -5, EPOCH_MAX, 2**70])
def test_any_first_epoch_becomes_one_that_fits(first: int) -> None:
    desk = LeaseDesk(["motion"], first_epoch=first)
    desk.handle(PartyJoined(ANNA), 0.0)
    desk.handle(Requested("a", "motion"), 0.0)
    assert 1 <= desk.epoch("motion") <= EPOCH_MAX


@pytest.mark.parametrize("expiry_s", [0.0, -1.0, float("nan")])
def test_a_lease_must_last(expiry_s: float) -> None:
    with pytest.raises(ValueError, match="positive"):
        LeaseDesk(["motion"], expiry_s=expiry_s)


# -- every state meets every event

CAST = (ANNA, BEN, PATROL, CHIEF, OLD_DASHBOARD)


def events_now(desk: LeaseDesk, now_s: float) -> list[tuple[Event, float]]:
    """Everything that can happen, now or after half of an expiry."""
    now: list[Event] = [Commanded("o", "motion")]
    for party in CAST:
        peer_id = party.peer_id
        if desk.party(peer_id) is None:
            now.append(PartyJoined(party))
            continue
        now += [PartyLeft(peer_id, True), PartyLeft(peer_id, False)]
        if not party.is_original:
            now += [Requested(peer_id, "motion"), Released(peer_id, "motion")]
    now.append(Requested("c", "motion", "reason", force=True))
    holder = desk.holder("motion")
    if holder is not None:
        now.append(Kept(holder.peer_id, {"motion": desk.epoch("motion")}))
        now += [RequestAnswered(holder.peer_id, "motion", one.party.peer_id, True) for one in desk.queue("motion")]
        now += [RequestAnswered(holder.peer_id, "motion", one.party.peer_id, False) for one in desk.queue("motion")]
    return [(event, now_s) for event in now] + [(DeadlinePassed(), now_s + 1.0)]


def state_of(desk: LeaseDesk, now_s: float) -> tuple[Any, ...]:
    """What matters for the future; epochs are only compared, and times only within the expiry."""
    holder, queue = desk.holder("motion"), [one.party.peer_id for one in desk.queue("motion")]
    left_s = None if desk.deadline_s is None else round(desk.deadline_s - now_s, 6)
    present = [desk.party(party.peer_id) is not None for party in CAST]
    return holder and holder.peer_id, tuple(queue), left_s, tuple(present)


def test_every_state_that_can_be_reached_meets_every_event() -> None:
    """Complete for five operators of all kinds and one resource: no depth limit."""
    seen: set[tuple[Any, ...]] = set()
    front = deque([(LeaseDesk(["motion"], first_epoch=7), 0.0)])
    transitions = 0
    while front:
        desk, now_s = front.popleft()
        for event, at_s in events_now(desk, now_s):
            after = pickle.loads(pickle.dumps(desk))
            effects = after.handle(event, at_s)
            transitions += 1
            check_transition(desk, after, effects, at_s)
            state = state_of(after, at_s)
            if state not in seen:
                seen.add(state)
                front.append((after, at_s))
    assert len(seen) > 500, "it came around"
    assert transitions > 5_000


def check_transition(before: LeaseDesk, after: LeaseDesk, effects: list[Effect], now_s: float) -> None:
    old, holder = before.holder("motion"), after.holder("motion")
    changes = [effect for effect in effects if isinstance(effect, LeaseChanged)]
    assert len(changes) == (before.epoch("motion") != after.epoch("motion")), "every change is told once"
    if changes:
        assert (changes[0].before, changes[0].holder) == (old, holder)
        assert changes[0].cause == "" or changes[0].cause in REASONS
        assert holder is None or after.epoch("motion") > before.epoch("motion")
    else:
        assert holder == old
    waiting = [one.party for one in after.queue("motion")]
    assert len({party.session_id for party in waiting}) == len(waiting)
    assert waiting == sorted(waiting, key=lambda party: not party.is_person), "persons before programs"
    assert holder is not None or not waiting, "what is free is given to who waits"
    assert holder not in waiting
    assert all(after.party(party.peer_id) is not None for party in waiting)
    assert (after.deadline_s is not None) == (holder is not None)
    assert after.deadline_s is None or now_s < after.deadline_s <= now_s + 2.0
    for reply in (effect for effect in effects if isinstance(effect, Reply)):
        assert after.party(reply.peer_id) is not None
        assert reply.code == "" or reply.code in REASONS
        assert (reply.outcome == "granted") == (holder is not None and reply.peer_id == holder.peer_id)
    check_refusals(after, now_s)


def check_refusals(desk: LeaseDesk, now_s: float) -> None:
    """Exactly one party's commands act, with exactly one epoch; a free lease admits originals that may take it."""
    holder, epoch = desk.holder("motion"), desk.epoch("motion")
    for party in CAST:
        is_present = desk.party(party.peer_id) is not None
        for said in (None, 0, epoch, max(epoch - 1, 0), 1):
            code = desk.refusal(party.peer_id, "motion", said, now_s)
            if party.is_original:
                may = is_present and holder in (None, party)
            else:
                may = is_present and holder == party and said == epoch
            assert (code is None) == may, (party, said, code)
            assert code is None or code in REASONS


# -- anything at all

IDS = st.sampled_from(["", "a", "b", "c", "o", "w", "ä" * 1000])
NAMES = st.sampled_from(["motion", "arm", "", "legs", "../motion"])
ROLES: list[Role] = ["operator", "observer", "supervisor"]
PARTIES = st.builds(
    Party, IDS, IDS, st.text(max_size=3), st.sampled_from(ROLES), st.booleans(), st.booleans()
)  # fmt: skip
EPOCHS = st.one_of(st.integers(-(2**70), 2**70), st.integers(95, 110))
EVENTS: st.SearchStrategy[Event] = st.one_of(
    st.builds(PartyJoined, PARTIES),
    st.builds(PartyLeft, IDS, st.booleans()),
    st.builds(Requested, IDS, NAMES, st.text(max_size=3), st.booleans()),
    st.builds(Released, IDS, NAMES),
    st.builds(RequestAnswered, IDS, NAMES, IDS, st.booleans()),
    st.builds(Kept, IDS, st.dictionaries(NAMES, EPOCHS, max_size=4)),
    st.builds(Commanded, IDS, NAMES),
    st.just(DeadlinePassed()),
)
STEPS = st.one_of(st.floats(0, 3), st.floats(-1e12, 1e12))


@settings(max_examples=300)
@given(st.lists(st.tuples(EVENTS, STEPS), max_size=40))
def test_no_sequence_of_events_raises_or_gives_to_somebody_who_did_not_ask(walk: list[tuple[Event, float]]) -> None:
    desk, now_s = LeaseDesk(["motion", "arm"], first_epoch=100), 0.0
    asked: set[str] = set()
    for event, step_s in walk:
        now_s += step_s
        if isinstance(event, Requested | Commanded):
            asked.add(event.peer_id)
        desk.handle(event, now_s)
        for resource in desk.resources:
            holder = desk.holder(resource)
            if holder is not None:
                assert holder.role != "observer"
                assert holder.peer_id in asked
            assert len(desk.queue(resource)) <= MAX_WAITING


def test_thousands_of_strange_resources_and_peers_leave_nothing_behind() -> None:
    desk = desk_with(ANNA, holder=ANNA)
    for number in range(5000):
        desk.handle(Requested(f"stranger {number}", "motion", "r", force=True), 0.1)
        desk.handle(Requested("a", f"resource {number}"), 0.1)
        desk.handle(Kept("a", {f"resource {number}": number}), 0.1)
        desk.handle(PartyJoined(Party(f"guest {number}", f"s{number}")), 0.1)
        desk.handle(Requested(f"guest {number}", "motion"), 0.1)
        desk.handle(PartyLeft(f"guest {number}", on_purpose=bool(number % 2)), 0.1)
    fresh = desk_with(ANNA, holder=ANNA)
    assert desk.queue("motion") == ()
    assert len(repr(vars(desk))) == len(repr(vars(fresh)))


def test_a_resource_that_comes_later_is_free_and_one_that_is_there_keeps_its_holder() -> None:
    desk = desk_with(ANNA, holder=ANNA)
    before = desk.resources
    held = [desk.holder(one) for one in before]
    assert desk.add([*before, "lamp", "lamp"]) == ("lamp",)
    assert desk.resources == (*before, "lamp")
    assert [desk.holder(one) for one in before] == held
    assert ANNA in held
    assert desk.holder("lamp") is None


def test_a_resource_that_comes_later_is_leased_under_its_own_name_and_for_the_same_time() -> None:
    desk = desk_with(ANNA)
    desk.add(["lamp"])
    assert desk.handle(Requested("a", "lamp"), 1.0) == [
        LeaseChanged("lamp", ANNA, 100, "", "Anna", None),
        Reply("a", "lamp", "granted", 100),
    ]
    assert desk.deadline_s == 3.0
    lost = change(desk.handle(DeadlinePassed(), 3.0))
    assert (lost.resource, lost.holder, lost.before) == ("lamp", None, ANNA)
