"""Which second peer connections a robot takes from one operator."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.peers.bulk_of_robot import (
    MAX_CANDIDATES,
    SETUP_TIMEOUT_S,
    AddBulkCandidate,
    AnswerOffer,
    BulkAnswerMade,
    BulkCloseHeard,
    BulkFailed,
    CandidateHeard,
    Connected,
    DeadlinePassed,
    DropBulk,
    Event,
    OfferHeard,
    RobotBulkMachine,
    TellBulkClosed,
    is_data_only,
)
from mosaic_core.words.codes import REASONS
from mosaic_core.words.signaling import IceCandidate

SDP = "v=0\r\nm=application 9 UDP/DTLS/SCTP webrtc-datachannel\r\n"
CANDIDATE = IceCandidate(candidate="candidate:1", sdp_mid="0")


def bulk_after(*events: Event) -> RobotBulkMachine:
    bulk = RobotBulkMachine()
    for event in events:
        bulk.handle(event, 0.0)
    return bulk


def test_an_offer_is_answered_and_its_connection_lives_without_a_deadline() -> None:
    bulk = RobotBulkMachine()
    assert bulk.handle(OfferHeard(1, SDP), 0.0) == [AnswerOffer(1, SDP)]
    assert (bulk.phase, bulk.deadline_s) == ("answering", SETUP_TIMEOUT_S)
    bulk.handle(BulkAnswerMade(1), 0.1)
    assert bulk.phase == "connecting"
    assert bulk.handle(Connected(1), 0.2) == []
    assert (bulk.phase, bulk.deadline_s) == ("up", None)


def test_one_that_does_not_come_up_in_time_is_dropped_and_told() -> None:
    bulk = bulk_after(OfferHeard(1, SDP), BulkAnswerMade(1))
    assert bulk.handle(DeadlinePassed(), SETUP_TIMEOUT_S - 1) == []
    assert bulk.handle(DeadlinePassed(), SETUP_TIMEOUT_S) == [DropBulk(), TellBulkClosed(1, "ice.timeout")]
    assert (bulk.phase, bulk.deadline_s) == ("none", None)


def test_a_newer_offer_takes_the_place_of_the_older_one() -> None:
    bulk = bulk_after(OfferHeard(1, SDP), BulkAnswerMade(1), Connected(1))
    assert bulk.handle(OfferHeard(2, SDP), 1.0) == [DropBulk(), AnswerOffer(2, SDP)]
    assert bulk.handle(BulkFailed(1, "peer.lost"), 1.0) == []
    assert bulk.phase == "answering"


@pytest.mark.parametrize("attempt", [1, 2])
def test_an_offer_that_comes_again_or_late_is_ignored(attempt: int) -> None:
    bulk = bulk_after(OfferHeard(2, SDP))
    assert bulk.handle(OfferHeard(attempt, SDP), 1.0) == []
    assert bulk.phase == "answering"


def test_offers_in_quick_succession_are_refused_in_words() -> None:
    bulk = bulk_after(OfferHeard(1, SDP), OfferHeard(2, SDP))
    refused = TellBulkClosed(3, "lane.refused", "too many attempts")
    assert bulk.handle(OfferHeard(3, SDP), 0.0) == [DropBulk(), refused]
    assert bulk.handle(OfferHeard(4, SDP), 2.0) == [AnswerOffer(4, SDP)]


@pytest.mark.parametrize(
    "sdp",
    [
        "v=0\r\nm=video 9 UDP/TLS/RTP/SAVPF 96\r\n",
        "v=0\nm=application 9 UDP/DTLS/SCTP webrtc-datachannel\nm=audio 9 UDP/TLS/RTP/SAVPF 111\n",
        SDP + "m=application 9 UDP/DTLS/SCTP webrtc-datachannel\r\n",
    ],
)
def test_media_lines_have_no_place_on_it(sdp: str) -> None:
    assert not is_data_only(sdp)
    bulk = RobotBulkMachine()
    assert [type(effect) for effect in bulk.handle(OfferHeard(1, sdp), 0.0)] == [TellBulkClosed]
    assert bulk.phase == "none"


def test_candidates_of_the_current_attempt_are_taken_up_to_a_bound() -> None:
    bulk = bulk_after(OfferHeard(2, SDP))
    assert bulk.handle(CandidateHeard(1, CANDIDATE), 0.0) == []
    for _ in range(MAX_CANDIDATES):
        assert bulk.handle(CandidateHeard(2, CANDIDATE), 0.0) == [AddBulkCandidate(CANDIDATE)]
    assert bulk.handle(CandidateHeard(2, CANDIDATE), 0.0) == []


def test_the_operator_closes_it_without_an_answer() -> None:
    bulk = bulk_after(OfferHeard(1, SDP), BulkAnswerMade(1), Connected(1))
    assert bulk.handle(BulkCloseHeard(7, "peer.closed"), 1.0) == []
    assert bulk.handle(BulkCloseHeard(1, "peer.closed"), 1.0) == [DropBulk()]
    assert bulk.handle(BulkCloseHeard(1, "peer.closed"), 1.0) == []


def test_a_failure_is_told_with_its_code() -> None:
    bulk = bulk_after(OfferHeard(1, SDP))
    assert bulk.handle(BulkFailed(1, "sdp.invalid", "no"), 0.0) == [
        DropBulk(),
        TellBulkClosed(1, "sdp.invalid", "no"),
    ]


def test_a_failure_without_a_code_is_named_by_how_far_it_came() -> None:
    answered = bulk_after(OfferHeard(1, SDP), BulkAnswerMade(1))
    assert answered.handle(BulkFailed(1), 0.0) == [DropBulk(), TellBulkClosed(1, "ice.failed")]
    connected = bulk_after(OfferHeard(1, SDP), BulkAnswerMade(1), Connected(1))
    assert connected.handle(BulkFailed(1), 0.0) == [DropBulk(), TellBulkClosed(1, "peer.lost")]


def test_an_answer_that_is_ready_when_it_is_over_changes_nothing() -> None:
    bulk = bulk_after(OfferHeard(1, SDP), BulkCloseHeard(1, "peer.closed"))
    assert bulk.handle(BulkAnswerMade(1), 0.0) == []
    assert bulk.phase == "none"


attempts = st.integers(1, 5)
events = st.one_of(
    st.builds(OfferHeard, attempts, st.sampled_from([SDP, "m=video 9 x 96"])),
    st.builds(CandidateHeard, attempts, st.just(CANDIDATE)),
    st.builds(BulkCloseHeard, attempts, st.just("peer.closed")),
    st.builds(BulkAnswerMade, attempts),
    st.builds(Connected, attempts),
    st.builds(BulkFailed, attempts, st.sampled_from(["ice.failed", "peer.lost"])),
    st.just(DeadlinePassed()),
)


@given(st.lists(st.tuples(events, st.floats(0, 12)), max_size=80))
def test_there_is_never_more_than_one_transport(steps: list[tuple[Event, float]]) -> None:
    bulk, now_s, transports = RobotBulkMachine(), 0.0, 0
    for event, wait_s in steps:
        now_s += wait_s
        for effect in bulk.handle(event, now_s):
            transports += {AnswerOffer: 1, DropBulk: -1}.get(type(effect), 0)
            assert transports in (0, 1)
            assert not isinstance(effect, TellBulkClosed) or effect.code in REASONS
    assert (transports == 1) == (bulk.phase != "none")
    assert (bulk.deadline_s is not None) == (bulk.phase in ("answering", "connecting"))
