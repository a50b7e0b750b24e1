"""What an operator believes about its leases follows from the robot's words alone."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.control.operator_control import (
    Asked,
    ConnectionEnded,
    ControlChanged,
    ControlHeard,
    DeadlinePassed,
    Denied,
    Effect,
    Event,
    GaveUp,
    Granted,
    LeaseView,
    Lost,
    OperatorControl,
    Queued,
    Say,
)
from mosaic_core.words import control

ME = "me"


def reply(outcome: Any, epoch: int = 0, code: str = "", resource: str = "motion") -> ControlHeard:
    return ControlHeard(control.LeaseReply(resource=resource, outcome=outcome, epoch=epoch, code=code))


def state(holder: str | None, epoch: int, resource: str = "motion") -> ControlHeard:
    peer = control.PeerInfo(peer_id=holder) if holder else None
    return ControlHeard(control.LeaseState(resource=resource, epoch=epoch, holder=peer, expiry_s=2))


def after(*events: Event) -> OperatorControl:
    machine = OperatorControl(ME)
    for event in events:
        machine.handle(event, 0.0)
    return machine


def test_asking_is_said_and_a_grant_is_held() -> None:
    machine = OperatorControl(ME)
    assert machine.handle(Asked("motion", "why", True), 0.0) == [
        Say(control.LeaseRequest(resource="motion", reason="why", force=True))
    ]
    assert machine.handle(reply("granted", 5), 1.0) == [Granted("motion", 5), ControlChanged()]
    assert machine.held == {"motion": 5}
    assert machine.leases["motion"] == LeaseView("motion", is_mine=True)


def test_what_is_held_is_kept_alive_twice_a_second_and_nothing_else_is() -> None:
    machine = after(Asked("motion"), Asked("arm"), reply("granted", 5), reply("granted", 6, resource="arm"))
    assert machine.deadline_s == 0.5
    assert machine.handle(DeadlinePassed(), 0.4) == []
    assert machine.handle(DeadlinePassed(), 0.5) == [Say(control.LeaseKeep(epochs={"motion": 5, "arm": 6}))]
    assert machine.deadline_s == 1.0
    machine.handle(GaveUp("motion"), 0.6)
    assert machine.handle(DeadlinePassed(), 1.0) == [Say(control.LeaseKeep(epochs={"arm": 6}))]
    machine.handle(GaveUp("arm"), 1.1)
    assert machine.deadline_s is None


@pytest.mark.parametrize(
    ("event", "effects"),
    [
        (reply("queued", code="lease.queued"), [Queued("motion")]),
        (reply("denied", code="lease.person_commands"), [Denied("motion", "lease.person_commands")]),
        (reply("denied"), [Denied("motion", "lease.denied")]),
        (reply("ended", code="lease.released"), []),
        (ConnectionEnded("peer.lost", "gone"), [Denied("motion", "peer.lost", "gone"), ControlChanged()]),
    ],
)
def test_who_asks_hears_the_answer(event: Event, effects: list[Effect]) -> None:
    assert after(Asked("motion")).handle(event, 0.0) == effects


@pytest.mark.parametrize("event", [reply("granted", 5), reply("queued"), reply("denied"), reply("ended")])
def test_an_answer_to_nobody_changes_nothing(event: Event) -> None:
    machine = OperatorControl(ME)
    assert machine.handle(event, 0.0) == []
    assert machine.held == {}


@pytest.mark.parametrize(
    ("event", "code"),
    [
        (reply("ended", code="lease.taken_over"), "lease.taken_over"),
        (reply("ended"), "lease.not_holder"),
        (state("bob", 6), "lease.not_holder"),
        (ConnectionEnded("peer.lost"), "peer.lost"),
    ],
)
def test_a_lease_that_ends_is_lost_and_no_longer_kept(event: Event, code: str) -> None:
    machine = after(Asked("motion"), reply("granted", 5))
    effects = machine.handle(event, 0.0)
    assert effects[0] == Lost("motion", code)
    assert machine.held == {}
    assert machine.deadline_s is None


@pytest.mark.parametrize("event", [state(ME, 5), state("bob", 5), state(None, 0)])
def test_a_state_that_names_no_newer_holder_ends_nothing(event: Event) -> None:
    machine = after(Asked("motion"), reply("granted", 5))
    assert machine.handle(event, 0.0) == [ControlChanged()]
    assert machine.held == {"motion": 5}
    assert machine.leases["motion"].is_mine


def test_a_new_grant_of_what_is_held_replaces_its_epoch() -> None:
    machine = after(Asked("motion"), reply("granted", 5), reply("granted", 8))
    assert machine.held == {"motion": 8}


def test_the_end_of_the_connection_forgets_what_was_known() -> None:
    machine = after(
        ControlHeard(control.Peers(you="you", peers=(control.PeerInfo(peer_id="bob"),))),
        ControlHeard(control.StopState(is_stopped=True)),
        ControlHeard(control.SafetyLimit(label="cmd_vel", factor=0.5)),
        state("bob", 3),
    )
    assert (len(machine.peers), len(machine.limits), len(machine.leases)) == (1, 1, 1)
    machine.handle(ConnectionEnded("peer.lost"), 0.0)
    assert (machine.peers, machine.limits, machine.leases, machine.stop_state) == ((), {}, {}, None)


def test_other_messages_are_none_of_its_business() -> None:
    assert OperatorControl(ME).handle(ControlHeard(control.Ping(t0=1)), 0.0) == []


resources = st.sampled_from(["motion", "arm"])
epochs = st.integers(1, 9)
events = st.one_of(
    st.builds(Asked, resources),
    st.builds(GaveUp, resources),
    st.builds(reply, st.sampled_from(["granted", "queued", "denied", "ended"]), epochs, st.just(""), resources),
    st.builds(state, st.sampled_from([ME, "bob", None]), epochs, resources),
    st.just(DeadlinePassed()),
    st.just(ConnectionEnded("peer.lost")),
)


@given(st.lists(st.tuples(events, st.floats(0, 1))))
def test_it_holds_only_what_was_asked_for_and_keeps_alive_exactly_what_it_holds(
    steps: list[tuple[Event, float]],
) -> None:
    machine, now_s, wanted = OperatorControl(ME), 0.0, set[str]()
    for event, wait_s in steps:
        now_s += wait_s
        match event:
            case Asked(resource):
                wanted.add(resource)
            case GaveUp(resource):
                wanted.discard(resource)
            case _:
                pass
        before = dict(machine.held)
        effects = machine.handle(event, now_s)
        lost = {effect.resource for effect in effects if isinstance(effect, Lost)}
        granted = {effect.resource for effect in effects if isinstance(effect, Granted)}
        assert set(machine.held) <= wanted
        assert granted <= set(machine.held)
        given_up = {event.resource} if isinstance(event, GaveUp) else set()
        assert set(before) - set(machine.held) == lost | (given_up & set(before))
        assert (machine.deadline_s is None) == (not machine.held)
        for effect in effects:
            if isinstance(effect, Say) and isinstance(effect.message, control.LeaseKeep):
                assert effect.message.epochs == before
        for resource, view in machine.leases.items():
            assert view.is_mine == (resource in machine.held)
