"""Which operators a robot takes, and whose session is whose."""

from __future__ import annotations

from typing import Any

import pytest

from mosaic_core.machines.signaling.peer_admission import (
    MAX_CANDIDATES,
    MAX_PREPARED,
    PREPARED_FOR_S,
    AddCandidate,
    PeerAdmission,
    PeerIdentity,
    RefusePeer,
    RenegotiatePeer,
    StartPeer,
    StopPeer,
)
from mosaic_core.machines.signaling.robot_places import HALF_OPEN_S, ROOM_TO_KEEP
from mosaic_core.words.control import Role
from mosaic_core.words.errors import AuthError
from mosaic_core.words.ice import IceServer
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
    assert offered(admission, "p2", "b/bob")[0].code == "signal.robot_busy"
    admission.connected("p1")
    assert admission.status(several=True) is RobotStatus.RTC_CONNECTED
    assert offered(admission, "p2", "b/bob")[0].code == "signal.robot_busy"
    admission.forget("p1")
    assert admission.status(several=True) is RobotStatus.READY_TO_CONNECT


def test_at_a_full_robot_a_session_replaces_its_own_peer_and_that_one_is_told_why() -> None:
    admission = PeerAdmission(1)
    offered(admission, "p1", "s/alice")
    admission.connected("p1")
    assert offered(admission, "p2", "t/alice")[0].code == "signal.robot_busy", "another session is somebody else's page"
    stop, start = offered(admission, "p3", "s/alice")
    assert stop == StopPeer("p1", "signal.robot_busy", was_connected=True)
    assert start.peer_id == "p3"


def test_at_a_full_robot_who_never_connected_makes_room_and_is_told_why() -> None:
    admission = PeerAdmission(1)
    offered(admission, "p1", "a/alice")
    stop, start = offered(admission, "p2", "b/bob", HALF_OPEN_S + 0.1)
    assert stop == StopPeer("p1", "signal.robot_busy", was_connected=False)
    assert start.peer_id == "p2"


@pytest.mark.parametrize(("role", "is_taken"), [("operator", False), ("observer", False), ("supervisor", True)])
def test_the_last_place_is_for_a_supervisor(role: Role, is_taken: bool) -> None:
    admission = PeerAdmission(ROOM_TO_KEEP)
    for number in range(1, ROOM_TO_KEEP):
        offered(admission, f"p{number}", f"s{number}/operator {number}")
        admission.connected(f"p{number}")
    admission.prepare(PrepareConnection(rtc_connection_id="last", ticket="t"), 0.0)
    (answer,) = decided(admission, "last", tickets=lambda *_: PeerIdentity("s", "dana", role=role))
    assert isinstance(answer, StartPeer if is_taken else RefusePeer)


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
    for _ in range(MAX_CANDIDATES + 5):
        assert not list(admission.candidate(message, 0.0))
    (start,) = offered(admission, "p1", None, 1.0)
    assert start.candidates == (CANDIDATE,) * MAX_CANDIDATES
    assert not list(admission.candidate(message, 1.0)), "those that came early count"


def test_a_running_peer_has_so_many_candidates_and_no_more() -> None:
    admission = PeerAdmission(4)
    decided(admission, "p1")
    message = ExchangeIceCandidate(rtc_connection_id="p1", ice_candidate=CANDIDATE)
    passed = [effect for _ in range(1000) for effect in admission.candidate(message, 1.0)]
    assert passed == [AddCandidate("p1", CANDIDATE)] * MAX_CANDIDATES


def test_candidates_for_nobody_are_dropped() -> None:
    admission = PeerAdmission(4)
    message = ExchangeIceCandidate(rtc_connection_id="unknown", ice_candidate=CANDIDATE)
    assert not list(admission.candidate(message, 0.0))


def test_a_preparation_that_nobody_follows_is_forgotten() -> None:
    admission = PeerAdmission(4)
    admission.prepare(PrepareConnection(rtc_connection_id="p1", ticket="a/alice"), 0.0)
    assert offered(admission, "p1", None, PREPARED_FOR_S + 1)[0].code == "auth.bad_ticket"


# -- what is said to whom


def full_offer(peer_id: str = "p1") -> SdpOffer:
    return SdpOffer(rtc_connection_id=peer_id, sdp_offer="v=0", tracks={"cam": "0"})


def decided(admission: PeerAdmission, peer_id: str, now_s: float = 0.0, **more: Any) -> Any:
    return list(admission.decide(full_offer(peer_id), now_s, **({"tickets": None, "several": True} | more)))


STUN, TURN, PUBLIC = (IceServer(urls=(f"stun:{name}",)) for name in ("own", "fresh", "welcome"))


@pytest.mark.parametrize(
    ("prepared", "servers"),
    [
        (PrepareConnection(rtc_connection_id="p1", ice_servers=(TURN,)), (STUN, TURN)),
        (PrepareConnection(rtc_connection_id="p1", ice_servers=()), (STUN,)),
        (PrepareConnection(rtc_connection_id="p1"), (STUN, PUBLIC)),
        (None, (STUN, PUBLIC)),
    ],
)
def test_its_own_ice_servers_always_count_and_of_the_servers_the_freshest(
    prepared: PrepareConnection | None, servers: tuple[IceServer, ...]
) -> None:
    admission = PeerAdmission(4)
    if prepared is not None:
        admission.prepare(prepared, 0.0)
    (start,) = decided(admission, "p1", configured=(STUN,), welcomed=(PUBLIC,))
    nobody = PeerIdentity("p1", "", "", role="operator", is_program=False)
    assert start == StartPeer("p1", nobody, "v=0", {"cam": "0"}, servers, ())


def test_a_further_offer_goes_on_with_its_tracks_and_uses_up_its_preparation() -> None:
    admission = PeerAdmission(4)
    sdp = "v=0\r\na=fingerprint:sha-256 AB:CD\r\n"
    again(admission, "AB:CD", True)
    admission.prepare(PrepareConnection(rtc_connection_id="p1", ticket="a/alice"), 0.0)
    offer = SdpOffer(rtc_connection_id="p1", sdp_offer=sdp, tracks={"cam": "1"})
    assert list(admission.decide(offer, 0.0, tickets=ticketed, several=True)) == [
        RenegotiatePeer("p1", sdp, {"cam": "1"})
    ]
    (anew,) = decided(admission, "p1", tickets=ticketed, several=False)
    assert anew.code == "auth.bad_ticket"


def test_a_candidate_of_a_running_peer_does_not_wait_for_its_next_offer() -> None:
    admission = PeerAdmission(4)
    decided(admission, "p1", several=False)
    admission.prepare(PrepareConnection(rtc_connection_id="p1"), 0.0)
    message = ExchangeIceCandidate(rtc_connection_id="p1", ice_candidate=CANDIDATE)
    assert list(admission.candidate(message, 0.0)) == [AddCandidate("p1", CANDIDATE)]
    _, start = decided(admission, "p1", several=False)
    assert start.candidates == ()


def test_a_ticket_is_checked_against_what_the_server_prepared() -> None:
    admission, seen = PeerAdmission(4), []
    prepared = PrepareConnection(rtc_connection_id="p1", ticket="t", session_id="s")
    admission.prepare(prepared, 0.0)

    def check(*asked: Any) -> PeerIdentity:
        seen.append(asked)
        return PeerIdentity("s")

    decided(admission, "p1", tickets=check)
    assert seen == [("t", prepared)]


def test_a_peer_is_stopped_or_refused_as_one_that_is_not_there_unless_it_is_said() -> None:
    assert not StopPeer("p1", "peer.closed").was_connected
    assert not RefusePeer("p1", "signal.bad_message").is_live


def test_every_refusal_says_why() -> None:
    admission = PeerAdmission(1)
    forged = PrepareConnection(rtc_connection_id="p0", ticket="forged")
    admission.prepare(forged, 0.0)
    assert decided(admission, "p0", tickets=ticketed) == [RefusePeer("p0", "auth.bad_ticket", "forged")]
    no_ticket = RefusePeer("p0", "auth.bad_ticket", "the offer came without a ticket")
    assert decided(admission, "p0", tickets=ticketed) == [no_ticket]
    offered(admission, "p1", "s/alice")
    live = RefusePeer("p1", "signal.bad_message", "this connection has its offer; a new one needs an id", True)
    assert decided(admission, "p1") == [live]
    busy = RefusePeer("p2", "signal.robot_busy", "the robot already has 1 operators")
    assert offered(admission, "p2", "t/bob") == [busy]
    taken = RefusePeer("p2", "peer.not_allowed", "this session belongs to another operator")
    assert offered(admission, "p2", "s/mallory") == [taken]


def test_a_preparation_without_a_ticket_is_no_preparation_where_tickets_count() -> None:
    admission = PeerAdmission(4)
    admission.prepare(PrepareConnection(rtc_connection_id="p1"), 0.0)
    assert decided(admission, "p1", tickets=ticketed)[0].code == "auth.bad_ticket"


def test_of_too_many_preparations_the_oldest_is_forgotten() -> None:
    admission = PeerAdmission(MAX_PREPARED + 1)
    for number in range(MAX_PREPARED + 1):
        admission.prepare(PrepareConnection(rtc_connection_id=f"p{number}", ticket=f"s{number}/alice{number}"), 0.0)
    found = [decided(admission, f"p{number}", tickets=ticketed)[0] for number in range(MAX_PREPARED + 1)]
    assert [isinstance(one, StartPeer) for one in found] == [False] + [True] * MAX_PREPARED


def test_a_preparation_that_is_made_anew_after_its_minute_is_among_the_newest() -> None:
    admission = PeerAdmission(4)
    admission.prepare(PrepareConnection(rtc_connection_id="p0", ticket="s/alice"), 0.0)
    for number in (1, 0, *range(2, MAX_PREPARED + 1)):
        admission.prepare(PrepareConnection(rtc_connection_id=f"p{number}", ticket=f"s{number}/alice"), 100.0)
    assert isinstance(decided(admission, "p0", 100.0, tickets=ticketed)[0], StartPeer)
    assert isinstance(decided(admission, "p1", 100.0, tickets=ticketed)[0], RefusePeer)


@pytest.mark.parametrize(("after_s", "kept"), [(PREPARED_FOR_S, True), (PREPARED_FOR_S + 0.1, False)])
def test_a_preparation_and_its_candidates_are_kept_for_a_minute(after_s: float, kept: bool) -> None:
    admission = PeerAdmission(4)
    admission.prepare(PrepareConnection(rtc_connection_id="p1", ticket="a/alice"), 5.0)
    message = ExchangeIceCandidate(rtc_connection_id="p1", ice_candidate=CANDIDATE)
    assert list(admission.candidate(message, 5.0 + after_s)) == []
    (start,) = decided(admission, "p1", 5.0)
    assert start.candidates == ((CANDIDATE,) if kept else ())


def test_what_is_forgotten_was_in_a_phase_and_leaves_nothing() -> None:
    admission = PeerAdmission(4)
    admission.connected("p1")
    assert (admission.forget("p1"), admission.status(several=False)) == (None, RobotStatus.READY_TO_CONNECT)
    offered(admission, "p1", "a/alice")
    admission.prepare(PrepareConnection(rtc_connection_id="p1", ticket="a/alice"), 0.0)
    assert admission.forget("p1") == "connecting"
    assert decided(admission, "p1", tickets=ticketed)[0].code == "auth.bad_ticket"
    offered(admission, "p1", "a/alice")
    admission.connected("p1")
    assert admission.forget("p1") == "connected"


def test_of_whom_is_forgotten_nothing_is_kept() -> None:
    admission = PeerAdmission(4)
    again(admission, "AB:CD", several=True)
    list(admission.candidate(ExchangeIceCandidate(rtc_connection_id="p1", ice_candidate=CANDIDATE), 0.0))
    admission.forget("p1")
    assert not any(kept for kept in vars(admission).values() if isinstance(kept, dict))


def test_toward_an_original_server_a_peer_that_never_connected_is_replaced_as_such() -> None:
    admission = PeerAdmission(1)
    decided(admission, "p1", several=False)
    stop, start = decided(admission, "p2", several=False)
    assert stop == StopPeer("p1", "peer.replaced", was_connected=False)
    assert start.peer_id == "p2"
    assert admission.forget("p1") is None


def test_an_operator_has_room_until_the_last_place_is_taken() -> None:
    admission = PeerAdmission(2)
    offered(admission, "p1", "a/alice")
    assert admission.status(several=True) is RobotStatus.READY_TO_CONNECT
    assert isinstance(offered(admission, "p2", "b/bob")[0], StartPeer)
    assert admission.status(several=True) is RobotStatus.READY_TO_CONNECT, "who is not connected yet may have to leave"
    admission.connected("p1")
    admission.connected("p2")
    assert admission.status(several=True) is RobotStatus.RTC_CONNECTED


@pytest.mark.parametrize(("said", "is_local"), [(True, True), (False, False), (None, False)])
def test_who_asked_over_the_servers_loopback_is_known_as_that(said: bool | None, is_local: bool) -> None:
    admission = PeerAdmission(4)
    admission.prepare(PrepareConnection(rtc_connection_id="p1", is_local=said), 0.0)
    assert decided(admission, "p1")[0].is_local is is_local
