"""Every phase of a peer is bounded, every end has a code and comes once."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.peers.peer_of_robot import (
    AnswerFailed,
    AnswerMade,
    ByeReceived,
    ChannelOpened,
    ClosePeer,
    CloseRequested,
    ControlReceived,
    DeadlinePassed,
    Doubted,
    Event,
    HelloReceived,
    RobotPeerMachine,
    TellConnected,
    TransportChanged,
    TreatAsOriginal,
    TreatAsOurs,
)
from mosaic_core.words.codes import REASONS


def in_phase(phase: str) -> RobotPeerMachine:
    it = RobotPeerMachine(0.0)
    path: dict[str, list[Event]] = {
        "answering": [],
        "connecting": [AnswerMade()],
        "securing": [AnswerMade(), TransportChanged("securing")],
        "greeting": [AnswerMade(), TransportChanged("connecting"), TransportChanged("connected")],
        "open": [AnswerMade(), TransportChanged("connected"), HelloReceived()],
        "closed": [CloseRequested("peer.closed")],
    }
    for event in path.get(phase, path["greeting"]):
        it.handle(event, 0.0)
    if phase == "original":
        it.handle(ChannelOpened("original"), 0.0)
    assert it.phase == phase
    return it


def test_a_peer_of_ours_says_hello_pings_and_says_bye() -> None:
    it = in_phase("connecting")
    assert it.handle(TransportChanged("connected"), 1.0) == [TellConnected()]
    assert it.handle(HelloReceived(), 1.1) == [TreatAsOurs()]
    for tick in range(20):
        assert it.handle(ControlReceived(), 1.1 + tick * 0.5) == []
    assert it.handle(ByeReceived("peer.closed"), 12.0) == [ClosePeer("peer.closed", "", False)]


def test_an_offer_of_pictures_alone_makes_an_original_one_as_soon_as_it_is_connected() -> None:
    it = RobotPeerMachine(0.0, is_media_only=True)
    it.handle(AnswerMade(), 0.0)
    assert it.handle(TransportChanged("connected"), 0.1) == [TellConnected(), TreatAsOriginal()]
    assert it.deadline_s is None, "an original peer is trusted to ICE"


def test_a_bare_channel_that_is_the_first_makes_an_original_one_at_once() -> None:
    it = in_phase("greeting")
    assert it.handle(ChannelOpened("original"), 0.1) == [TreatAsOriginal()]
    assert it.handle(ChannelOpened("unknown"), 0.1) == []
    assert it.deadline_s is None


def test_a_first_bare_channel_that_overtakes_the_state_event_counts_as_connected() -> None:
    it = in_phase("securing")
    assert it.handle(ChannelOpened("original"), 1.0) == [TellConnected(), TreatAsOriginal()]
    assert it.handle(TransportChanged("connected"), 1.1) == []


@pytest.mark.parametrize("phase", ["securing", "greeting"])
def test_a_further_bare_channel_makes_an_original_one_after_two_seconds_without_a_channel_of_ours(phase: str) -> None:
    it = in_phase(phase)
    assert it.handle(ChannelOpened("unknown"), 1.0) == []
    it.handle(TransportChanged("connected"), 1.0)
    assert it.handle(DeadlinePassed(), 2.9) == []
    assert it.handle(ChannelOpened("unknown"), 2.9) == [], "further ones add nothing"
    assert it.handle(DeadlinePassed(), 3.0) == [TreatAsOriginal()]


def test_a_slow_operator_of_ours_is_never_taken_for_an_original_one() -> None:
    slow = in_phase("greeting")
    assert slow.handle(DeadlinePassed(), 9.9) == [], "its channels may be repeated for long"
    assert slow.handle(ChannelOpened("unknown"), 9.9) == [], "it has taken the robot for an original one"
    assert slow.handle(ChannelOpened("ours"), 11.0) == []
    assert slow.handle(DeadlinePassed(), 20.9) == [], "it will say hello"
    assert slow.handle(HelloReceived(), 20.9) == [TreatAsOurs()]


def test_a_channel_of_ours_and_no_hello_ends_the_connection() -> None:
    it = in_phase("greeting")
    it.handle(ChannelOpened("ours"), 1.0)
    for now_s in range(2, 11):
        assert it.handle(ChannelOpened("ours"), now_s) == [], "further ones win no time"
    assert it.handle(DeadlinePassed(), 11.0) == [ClosePeer("channel.timeout", "", False)]


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
    assert isinstance(end, ClosePeer)
    assert (end.code, end.say_bye) == ("peer.lost", False)


def test_a_doubt_shortens_the_time_that_a_silent_peer_has_and_never_prolongs_it() -> None:
    it = in_phase("open")
    before_s = it.deadline_s
    assert before_s is not None
    it.handle(Doubted(100.0), 0.0)
    assert it.deadline_s == before_s
    it.handle(Doubted(0.25), 0.0)
    assert it.deadline_s == 0.25


def test_when_the_robot_itself_stood_still_waiting_pings_get_their_chance() -> None:
    it = in_phase("open")
    assert it.handle(DeadlinePassed(), 7.0) == []
    assert it.phase == "open"
    it.handle(ControlReceived(), 7.01)
    assert it.deadline_s == pytest.approx(9.01)


def test_after_a_stall_a_peer_that_stays_silent_is_lost_all_the_same() -> None:
    it = in_phase("open")
    it.handle(DeadlinePassed(), 7.0)
    assert [type(effect) for effect in it.handle(DeadlinePassed(), 7.5)] == [ClosePeer]


@pytest.mark.parametrize(
    ("phase", "seconds", "code"),
    [("answering", 15.0, "sdp.timeout"), ("connecting", 20.0, "ice.timeout"), ("securing", 10.0, "dtls.timeout")],
)
def test_a_phase_that_takes_too_long_ends_with_its_code(phase: str, seconds: float, code: str) -> None:
    it = in_phase(phase)
    assert it.deadline_s == seconds
    assert it.handle(DeadlinePassed(), seconds) == [ClosePeer(code, "", False)]


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
    assert in_phase(phase).handle(TransportChanged(state), 3.0) == [ClosePeer(code, "", False)]


def test_channels_that_were_offered_and_never_open_end_the_connection() -> None:
    it = in_phase("greeting")
    assert it.deadline_s == 10.0
    assert it.handle(DeadlinePassed(), 10.0) == [ClosePeer("channel.timeout", "", False)]


def test_a_failed_answer_ends_with_its_reason() -> None:
    end = in_phase("answering").handle(AnswerFailed("sdp.no_common_codec", "VP9"), 0.0)
    assert end == [ClosePeer("sdp.no_common_codec", "VP9", False)]


def test_a_bye_is_said_only_to_a_peer_that_understands_it() -> None:
    assert in_phase("open").handle(CloseRequested("peer.shutdown"), 1.0) == [ClosePeer("peer.shutdown", "", True)]
    assert in_phase("original").handle(CloseRequested("peer.shutdown"), 1.0) == [ClosePeer("peer.shutdown", "", False)]


OURS: list[Event] = [
    AnswerMade(),
    *(TransportChanged(state) for state in ("connecting", "securing", "connected")),
    *(ChannelOpened("ours") for _ in range(3)),
    HelloReceived(),
    ControlReceived(),
]
"""What comes of an operator of ours that greets, once each."""
ORIGINALS: list[Event] = [*OURS[:4], ChannelOpened("original"), *(ChannelOpened("unknown") for _ in range(2))]
EVENTS: list[Event] = [
    AnswerMade(),
    AnswerFailed("sdp.invalid"),
    *(TransportChanged(state) for state in ("connecting", "securing", "connected", "failed", "closed", "news")),
    *(ChannelOpened(by) for by in ("ours", "original", "unknown")),
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
    assert (it.phase == "closed") == (phase == "closed" or any(isinstance(effect, ClosePeer) for effect in effects))


@given(st.permutations(OURS), st.lists(st.floats(0, 0.9), min_size=9, max_size=9))
def test_an_operator_of_ours_is_one_whatever_comes_first_and_however_slowly(
    order: list[Event], steps_s: list[float]
) -> None:
    it, now_s, effects = RobotPeerMachine(0.0), 0.0, []
    for event, step_s in zip(order, steps_s, strict=True):
        now_s += step_s
        effects += [*it.handle(DeadlinePassed(), now_s), *it.handle(event, now_s)]
        if it.phase == "open":
            break  # from here on it pings
    assert effects == [TellConnected(), TreatAsOurs()]


@given(st.permutations(ORIGINALS), st.lists(st.floats(0, 0.5), min_size=7, max_size=7))
def test_an_original_operator_is_known_as_soon_as_its_first_channel_opens(
    order: list[Event], steps_s: list[float]
) -> None:
    it, now_s, effects = RobotPeerMachine(0.0), 0.0, []
    for event, step_s in zip(order, steps_s, strict=True):
        now_s += step_s
        effects += it.handle(event, now_s)
        if event == ChannelOpened("original"):
            assert effects == [TellConnected(), TreatAsOriginal()]
    assert effects == [TellConnected(), TreatAsOriginal()]


@given(st.permutations([*ORIGINALS[:4], ChannelOpened("unknown"), ChannelOpened("ours"), HelloReceived()]))
def test_an_operator_of_ours_that_took_the_robot_for_an_original_one_is_one_of_ours(order: list[Event]) -> None:
    it, effects = RobotPeerMachine(0.0), []
    for event in order:
        effects += it.handle(event, 1.0)
    assert effects == [TellConnected(), TreatAsOurs()]


@given(st.lists(st.tuples(st.sampled_from(EVENTS), st.floats(0, 5)), max_size=40))
def test_a_random_walk_connects_and_closes_at_most_once(walk: list[tuple[Event, float]]) -> None:
    it, now_s, effects = RobotPeerMachine(0.0), 0.0, []
    for event, step_s in walk:
        now_s += step_s
        effects += it.handle(event, now_s)
    kinds = [type(effect) for effect in effects]
    assert kinds.count(ClosePeer) <= 1
    assert kinds.count(TellConnected) <= 1
    assert kinds.count(TreatAsOurs) <= 1
    assert all(effect.code in REASONS for effect in effects if isinstance(effect, ClosePeer))
    assert it.phase in ("closed", "original") or it.deadline_s is not None, "every other phase is bounded"
