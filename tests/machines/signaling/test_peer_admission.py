"""Which operators a robot takes, and whose session is whose."""

from __future__ import annotations

from typing import Any

import pytest

from mosaic_core.machines.signaling.peer_admission import (
    MAX_EARLY_CANDIDATES,
    PREPARED_FOR_S,
    AddCandidate,
    PeerAdmission,
    PeerIdentity,
    RefusePeer,
    RenegotiatePeer,
    StartPeer,
    StopPeer,
)
from mosaic_core.words.errors import AuthError
from mosaic_core.words.signaling import ExchangeIceCandidate, IceCandidate, PrepareConnection, RobotStatus, SdpOffer

CANDIDATE = IceCandidate(candidate="candidate:1", sdp_mid="0")


def ticketed(ticket: str, prepared: PrepareConnection) -> PeerIdentity:
    """A ticket reads ``session/operator``; ``forged`` is refused."""
    if ticket == "forged":
        raise AuthError("forged", code="auth.bad_ticket")
    session_id, operator_id = ticket.split("/")
    return PeerIdentity(session_id, operator_id)


def offered(
    admission: PeerAdmission, peer_id: str, ticket: str | None, now_s: float = 0.0, several: bool = True
) -> Any:
    if ticket is not None:
        admission.prepare(PrepareConnection(rtc_connection_id=peer_id, ticket=ticket), now_s)
    offer = SdpOffer(rtc_connection_id=peer_id, sdp_offer="v=0")
    return list(admission.decide(offer, now_s, tickets=ticketed, several=several))


def test_a_ticketed_operator_is_taken() -> None:
    (start,) = offered(PeerAdmission(4), "p1", "s/alice")
    assert isinstance(start, StartPeer)
    assert start.identity == PeerIdentity("s", "alice")


@pytest.mark.parametrize("ticket", [None, "forged"])
def test_without_a_good_ticket_nobody_is_taken(ticket: str | None) -> None:
    (refused,) = offered(PeerAdmission(4), "p1", ticket)
    assert isinstance(refused, RefusePeer)
    assert refused.code == "auth.bad_ticket"


def test_an_operator_comes_back_into_the_own_session() -> None:
    admission = PeerAdmission(4)
    offered(admission, "p1", "s/alice")
    assert isinstance(offered(admission, "p2", "s/alice")[0], StartPeer)


def test_nobody_enters_the_session_of_another_operator() -> None:
    admission = PeerAdmission(4)
    offered(admission, "p1", "s/alice")
    (refused,) = offered(admission, "p2", "s/mallory")
    assert isinstance(refused, RefusePeer)
    assert refused.code == "peer.not_allowed"
    admission.forget("p1")
    assert isinstance(offered(admission, "p3", "s/mallory")[0], StartPeer), "an ended session is nobody's"


def test_more_than_fits_is_told_so() -> None:
    admission = PeerAdmission(1)
    offered(admission, "p1", "a/alice")
    assert admission.status(several=True) is RobotStatus.RTC_CONNECTED
    assert offered(admission, "p2", "b/bob")[0].code == "signal.robot_busy"
    admission.forget("p1")
    assert admission.status(several=True) is RobotStatus.READY_TO_CONNECT


def test_a_connection_has_one_offer() -> None:
    admission = PeerAdmission(4)
    offered(admission, "p1", "a/alice")
    assert offered(admission, "p1", "a/alice")[0].code == "signal.bad_message"


def again(admission: PeerAdmission, certificate: str, several: bool) -> Any:
    offer = SdpOffer(rtc_connection_id="p1", sdp_offer=f"v=0\r\na=fingerprint:sha-256 {certificate}\r\n")
    return list(admission.decide(offer, 0.0, tickets=None, several=several))


@pytest.mark.parametrize("several", [True, False])
def test_a_further_offer_of_the_same_peer_connection_renegotiates_it(several: bool) -> None:
    admission = PeerAdmission(4)
    assert isinstance(again(admission, "AB:CD", several)[0], StartPeer)
    (further,) = again(admission, "ab:cd", several)
    assert isinstance(further, RenegotiatePeer)
    assert further.peer_id == "p1"
    admission.forget("p1")
    assert isinstance(again(admission, "AB:CD", several)[0], StartPeer), "it is over: this one starts anew"


def test_another_peer_connection_under_a_live_id_leaves_the_live_one_alone() -> None:
    admission = PeerAdmission(4)
    again(admission, "AB:CD", True)
    (refused,) = again(admission, "00:00", True)
    assert isinstance(refused, RefusePeer)
    assert refused.is_live
    assert isinstance(again(admission, "AB:CD", True)[0], RenegotiatePeer)


def test_toward_an_original_server_a_page_that_starts_over_under_its_id_takes_its_own_place() -> None:
    admission = PeerAdmission(4)
    again(admission, "AB:CD", False)
    stopped, started = again(admission, "00:00", False)
    assert isinstance(stopped, StopPeer)
    assert isinstance(started, StartPeer)


def test_toward_an_original_server_the_newest_offer_wins() -> None:
    admission = PeerAdmission(4)
    offer = SdpOffer(rtc_connection_id="p1", sdp_offer="v=0")
    list(admission.decide(offer, 0.0, tickets=None, several=False))
    admission.connected("p1")
    assert admission.status(several=False) is RobotStatus.RTC_CONNECTED
    again = SdpOffer(rtc_connection_id="p2", sdp_offer="v=0")
    stop, start = admission.decide(again, 1.0, tickets=None, several=False)
    assert stop == StopPeer("p1", "peer.replaced", was_connected=True)
    assert isinstance(start, StartPeer)
    assert start.identity.session_id == "p2"
    assert admission.status(several=False) is RobotStatus.RTC_CONNECTING


def test_candidates_wait_for_their_offer_and_not_for_ever() -> None:
    admission = PeerAdmission(4)
    admission.prepare(PrepareConnection(rtc_connection_id="p1", ticket="a/alice"), 0.0)
    message = ExchangeIceCandidate(rtc_connection_id="p1", ice_candidate=CANDIDATE)
    for _ in range(MAX_EARLY_CANDIDATES + 5):
        assert not list(admission.candidate(message, 0.0))
    (start,) = offered(admission, "p1", None, 1.0)
    assert start.candidates == (CANDIDATE,) * MAX_EARLY_CANDIDATES
    assert list(admission.candidate(message, 1.0)) == [AddCandidate("p1", CANDIDATE)]


def test_candidates_for_nobody_are_dropped() -> None:
    admission = PeerAdmission(4)
    message = ExchangeIceCandidate(rtc_connection_id="unknown", ice_candidate=CANDIDATE)
    assert not list(admission.candidate(message, 0.0))


def test_a_preparation_that_nobody_follows_is_forgotten() -> None:
    admission = PeerAdmission(4)
    admission.prepare(PrepareConnection(rtc_connection_id="p1", ticket="a/alice"), 0.0)
    assert offered(admission, "p1", None, PREPARED_FOR_S + 1)[0].code == "auth.bad_ticket"
