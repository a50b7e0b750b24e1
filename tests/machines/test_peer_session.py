"""Every phase of a peer is bounded, every end has a code and comes once."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.peer_session import (
    Answered,
    AnswerFailed,
    ByeReceived,
    ChannelOpened,
    Close,
    CloseRequested,
    ControlReceived,
    DeadlinePassed,
    Event,
    HelloReceived,
    PeerSession,
    TellConnected,
    TransportChanged,
    TreatAsOriginal,
    TreatAsOurs,
)
from mosaic_core.words.codes import REASONS


def in_phase(phase: str) -> PeerSession:
    it = PeerSession(0.0)
    path: dict[str, list[Event]] = {
        "answering": [],
        "connecting": [Answered()],
        "securing": [Answered(), TransportChanged("securing")],
        "greeting": [Answered(), TransportChanged("connecting"), TransportChanged("connected")],
        "open": [Answered(), TransportChanged("connected"), HelloReceived()],
        "closed": [CloseRequested("peer.closed")],
    }
    for event in path.get(phase, path["greeting"]):
        it.handle(event, 0.0)
    if phase == "original":
        it.handle(DeadlinePassed(), 2.0)
    assert it.phase == phase
    return it


def test_a_peer_of_ours_says_hello_pings_and_says_bye() -> None:
    it = in_phase("connecting")
    assert it.handle(TransportChanged("connected"), 1.0) == [TellConnected()]
    assert it.handle(HelloReceived(), 1.1) == [TreatAsOurs()]
    for tick in range(20):
        assert it.handle(ControlReceived(), 1.1 + tick * 0.5) == []
    assert it.handle(ByeReceived("peer.closed"), 12.0) == [Close("peer.closed", "", False)]


def test_a_peer_that_says_no_hello_in_two_seconds_is_an_original_one() -> None:
    it = in_phase("greeting")
    assert it.handle(DeadlinePassed(), 1.9) == []
    assert it.handle(DeadlinePassed(), 2.0) == [TreatAsOriginal()]
    assert it.deadline_s is None, "an original peer is trusted to ICE"


def test_a_late_hello_is_believed() -> None:
    it = in_phase("original")
    assert it.handle(HelloReceived(), 5.0) == [TreatAsOurs()]
    assert it.phase == "open"


def test_a_hello_that_overtakes_the_state_event_counts_as_connected() -> None:
    it = in_phase("connecting")
    assert it.handle(HelloReceived(), 1.0) == [TellConnected(), TreatAsOurs()]
    assert it.handle(TransportChanged("connected"), 1.1) == []


def test_two_silent_seconds_are_a_lost_peer() -> None:
    it = in_phase("open")
    it.handle(ControlReceived(), 10.0)
    assert it.deadline_s == 12.0
    assert it.handle(DeadlinePassed(), 11.99) == []
    [end] = it.handle(DeadlinePassed(), 12.0)
    assert isinstance(end, Close)
    assert (end.code, end.say_bye) == ("peer.lost", False)


def test_when_the_robot_itself_stood_still_waiting_pings_get_their_chance() -> None:
    it = in_phase("open")
    assert it.handle(DeadlinePassed(), 7.0) == []
    assert it.phase == "open"
    it.handle(ControlReceived(), 7.01)
    assert it.deadline_s == pytest.approx(9.01)


def test_after_a_stall_a_peer_that_stays_silent_is_lost_all_the_same() -> None:
    it = in_phase("open")
    it.handle(DeadlinePassed(), 7.0)
    assert [type(effect) for effect in it.handle(DeadlinePassed(), 7.5)] == [Close]


@pytest.mark.parametrize(
    ("phase", "seconds", "code"),
    [("answering", 15.0, "sdp.timeout"), ("connecting", 20.0, "ice.timeout"), ("securing", 10.0, "dtls.timeout")],
)
def test_a_phase_that_takes_too_long_ends_with_its_code(phase: str, seconds: float, code: str) -> None:
    it = in_phase(phase)
    assert it.deadline_s == seconds
    assert it.handle(DeadlinePassed(), seconds) == [Close(code, "", False)]


@pytest.mark.parametrize(
    ("phase", "state", "code"),
    [
        ("connecting", "failed", "ice.failed"),
        ("securing", "failed", "dtls.failed"),
        ("open", "failed", "peer.lost"),
        ("original", "failed", "peer.lost"),
        ("connecting", "closed", "ice.failed"),
        ("open", "closed", "peer.closed"),
    ],
)
def test_the_end_of_the_transport_has_the_code_of_its_phase(phase: str, state: str, code: str) -> None:
    assert in_phase(phase).handle(TransportChanged(state), 3.0) == [Close(code, "", False)]


def connected_original(expects_channels: bool) -> PeerSession:
    it = PeerSession(0.0, expects_channels=expects_channels)
    for event in (Answered(), TransportChanged("connected")):
        it.handle(event, 0.0)
    it.handle(DeadlinePassed(), 2.0)
    assert it.phase == "original"
    return it


def test_channels_that_were_offered_and_never_open_end_the_connection() -> None:
    assert connected_original(True).handle(DeadlinePassed(), 10.0) == [Close("channel.timeout", "", False)]


def test_one_channel_of_an_original_operator_is_enough() -> None:
    it = connected_original(True)
    it.handle(ChannelOpened(), 9.9)
    assert it.deadline_s is None
    assert connected_original(False).deadline_s is None, "pictures alone need no channel"


def test_a_failed_answer_ends_with_its_reason() -> None:
    end = in_phase("answering").handle(AnswerFailed("sdp.no_common_codec", "VP9"), 0.0)
    assert end == [Close("sdp.no_common_codec", "VP9", False)]


def test_a_bye_is_said_only_to_a_peer_that_understands_it() -> None:
    assert in_phase("open").handle(CloseRequested("peer.shutdown"), 1.0) == [Close("peer.shutdown", "", True)]
    assert in_phase("original").handle(CloseRequested("peer.shutdown"), 1.0) == [Close("peer.shutdown", "", False)]


EVENTS: list[Event] = [
    Answered(),
    AnswerFailed("sdp.invalid"),
    *(TransportChanged(state) for state in ("connecting", "securing", "connected", "failed", "closed", "news")),
    ChannelOpened(),
    HelloReceived(),
    ControlReceived(),
    ByeReceived("peer.closed"),
    CloseRequested("peer.replaced"),
    DeadlinePassed(),
]
PHASES = ["answering", "connecting", "securing", "greeting", "open", "original", "closed"]


@pytest.mark.parametrize("phase", PHASES)
@pytest.mark.parametrize("event", EVENTS, ids=repr)
def test_every_phase_meets_every_event(phase: str, event: Event) -> None:
    it = in_phase(phase)
    effects = it.handle(event, 50.0)
    assert it.phase in PHASES
    assert (it.phase == "closed") == (phase == "closed" or any(isinstance(effect, Close) for effect in effects))


@given(st.lists(st.tuples(st.sampled_from(EVENTS), st.floats(0, 5)), max_size=40))
def test_a_random_walk_connects_and_closes_at_most_once(walk: list[tuple[Event, float]]) -> None:
    it, now_s, effects = PeerSession(0.0), 0.0, []
    for event, step_s in walk:
        now_s += step_s
        effects += it.handle(event, now_s)
    kinds = [type(effect) for effect in effects]
    assert kinds.count(Close) <= 1
    assert kinds.count(TellConnected) <= 1
    assert kinds.count(TreatAsOurs) <= 1
    assert all(effect.code in REASONS for effect in effects if isinstance(effect, Close))
    assert it.phase in ("closed", "original") or it.deadline_s is not None, "every other phase is bounded"
