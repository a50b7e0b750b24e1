"""Every phase of the operator's peer connection is bounded, and every end has a known code."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.peers.peer_of_operator import (
    CHANNEL_TIMEOUT_S,
    KNOWN_ORIGINAL_S,
    AnswerReceived,
    ControlOpened,
    ControlReceived,
    DeadlinePassed,
    Effect,
    End,
    EndReceived,
    EndRequested,
    Event,
    HelloReceived,
    OfferMade,
    OperatorPeerMachine,
    PatienceLost,
    SendPing,
    TransportChanged,
    UseConnection,
)
from mosaic_core.words.codes import REASONS

TO_GREETING: tuple[Event, ...] = (
    OfferMade(),
    AnswerReceived(),
    TransportChanged("securing"),
    TransportChanged("connected"),
    ControlOpened(),
)


def peer_after(*events: Event, was_original: bool = False) -> OperatorPeerMachine:
    peer = OperatorPeerMachine(0.0, was_original=was_original)
    for event in events:
        peer.handle(event, 0.0)
    return peer


def run_until(peer: OperatorPeerMachine, end_s: float) -> list[tuple[float, Effect]]:
    told: list[tuple[float, Effect]] = []
    while peer.deadline_s is not None and peer.deadline_s <= end_s:
        at_s = peer.deadline_s
        told += [(at_s, effect) for effect in peer.handle(DeadlinePassed(), at_s)]
    return told


def test_a_robot_of_ours_is_used_at_its_hello_and_pinged_twice_a_second() -> None:
    peer = peer_after(*TO_GREETING)
    assert peer.handle(HelloReceived(), 1.0) == [UseConnection(True), SendPing()]
    assert [at for at, _ in run_until(peer, 2.4)] == [1.5, 2.0]


def test_two_seconds_of_silence_are_the_end() -> None:
    peer = peer_after(*TO_GREETING, HelloReceived())
    *pings, (at_s, end) = run_until(peer, 60)
    assert len(pings) == 3
    assert (at_s, end) == (2.0, End("peer.lost", "", True))


def test_any_word_keeps_it_alive() -> None:
    peer = peer_after(*TO_GREETING, HelloReceived())
    for step in range(1, 40):
        run_until(peer, step * 0.5)
        peer.handle(ControlReceived(), step * 0.5)
    assert peer.phase == "open"


def test_our_own_stall_is_not_the_robots_silence() -> None:
    peer = peer_after(*TO_GREETING, HelloReceived())
    assert peer.handle(DeadlinePassed(), 30.0) == [SendPing()]
    assert run_until(peer, 60)[-1] == (32.0, End("peer.lost", "", True))


def test_without_a_hello_the_robot_is_an_original_one_and_trusted_to_ice() -> None:
    peer = peer_after(*TO_GREETING)
    assert run_until(peer, 1000) == [(2.0, UseConnection(False))]
    assert peer.handle(HelloReceived(), 1001.0)[0] == UseConnection(True)


@pytest.mark.parametrize(
    ("events", "code"),
    [
        ((), "sdp.timeout"),
        (TO_GREETING[:1], "signal.no_answer"),
        (TO_GREETING[:2], "ice.timeout"),
        (TO_GREETING[:3], "dtls.timeout"),
        (TO_GREETING[:4], "channel.timeout"),
    ],
)
def test_each_phase_has_its_own_time_out(events: tuple[Event, ...], code: str) -> None:
    (at_s, end), *rest = run_until(peer_after(*events), 1000)
    assert isinstance(end, End)
    assert (end.code, end.tells_robot, rest) == (code, bool(events), [])
    assert at_s <= 20


@pytest.mark.parametrize(
    ("events", "code"),
    [
        ((), "sdp.timeout"),
        (TO_GREETING[:1], "signal.no_answer"),
        (TO_GREETING[:3], "dtls.timeout"),
        (TO_GREETING, "channel.timeout"),
    ],
)
def test_who_waits_no_longer_is_told_by_the_phase_what_was_missing(events: tuple[Event, ...], code: str) -> None:
    peer = peer_after(*events)
    assert peer.handle(PatienceLost(), 1.0) == [End(code, "", True)]
    assert (peer.phase, peer.deadline_s) == ("closed", None)
    assert peer.handle(PatienceLost(), 1.0) == []


@pytest.mark.parametrize(
    ("events", "code"),
    [(TO_GREETING[:2], "ice.failed"), (TO_GREETING[:3], "dtls.failed"), (TO_GREETING, "peer.lost")],
)
def test_a_failed_transport_names_its_phase(events: tuple[Event, ...], code: str) -> None:
    assert peer_after(*events).handle(TransportChanged("failed"), 1.0) == [End(code, "", True)]


def test_a_robot_that_was_an_original_one_is_not_waited_for_again_but_may_be_another_now() -> None:
    peer = peer_after(*TO_GREETING, was_original=True)
    assert run_until(peer, 1.0) == [(KNOWN_ORIGINAL_S, UseConnection(False))]
    assert peer.handle(HelloReceived(), 1.0) == [UseConnection(True), SendPing()]


def test_silence_counts_from_the_open_channel_on() -> None:
    peer = peer_after(*TO_GREETING[:4])
    peer.handle(ControlOpened(), 5.0)
    assert run_until(peer, 60) == [(7.0, UseConnection(False))]
    early = peer_after(*TO_GREETING[:3], ControlOpened(), TransportChanged("connected"))
    assert run_until(early, 60) == [(2.0, UseConnection(False))], "the order of the two is not promised"
    assert CHANNEL_TIMEOUT_S > 2.0


def test_an_end_of_the_robots_is_not_told_back_to_it() -> None:
    assert peer_after(OfferMade()).handle(EndReceived("auth.bad_ticket", "no"), 1.0) == [
        End("auth.bad_ticket", "no", False)
    ]
    assert peer_after(OfferMade()).handle(TransportChanged("closed"), 1.0) == [End("peer.closed", "", False)]


EVENTS = st.sampled_from([
    OfferMade(), AnswerReceived(), ControlOpened(), HelloReceived(), ControlReceived(), EndRequested(),
    DeadlinePassed(),
    PatienceLost(),
    EndReceived("peer.shutdown"),
    *(TransportChanged(s) for s in ("connecting", "securing", "connected", "failed", "closed", "?")),
])  # fmt: skip


@given(st.lists(st.tuples(EVENTS, st.floats(0, 5)), max_size=60))
def test_a_random_walk_ends_once_with_a_known_code_and_never_forgets_its_deadline(
    walk: list[tuple[Event, float]],
) -> None:
    peer, now_s, ends = OperatorPeerMachine(0.0), 0.0, []
    for event, later_s in walk:
        now_s += later_s
        ends += [effect for effect in peer.handle(event, now_s) if isinstance(effect, End)]
        assert (peer.deadline_s is None) == (peer.phase in ("closed", "original"))
    assert len(ends) <= 1
    assert all(end.code in REASONS for end in ends)
    assert (peer.phase == "closed") == bool(ends)
