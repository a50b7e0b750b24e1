"""The robot's session with an original server, with ours, and with one that misbehaves."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.signaling.peer_admission import AddCandidate, PeerIdentity, RefusePeer, StartPeer, StopPeer
from mosaic_core.machines.signaling.robot_signaling import RobotSignaling
from mosaic_core.machines.signaling.signaling_events import (
    CatalogueChanged,
    ChangeState,
    CloseSocket,
    ConnectFailed,
    DeadlinePassed,
    Effect,
    Event,
    FrameReceived,
    MessageReady,
    PeerConnected,
    PeerEnded,
    ReconnectAfter,
    Report,
    RobotFacts,
    SendSignal,
    ShutdownBegun,
    SocketClosed,
    SocketOpened,
)
from mosaic_core.machines.signaling.signaling_session import GREETING_TIMEOUT_S, SILENCE_TIMEOUT_S
from mosaic_core.words.catalogue import Catalogue, CatalogueEntry
from mosaic_core.words.codes import REASONS
from mosaic_core.words.data_type import Direction, MosaicDataType
from mosaic_core.words.errors import AuthError
from mosaic_core.words.ice import IceServer
from mosaic_core.words.signaling import PrepareConnection, SdpAnswer, TicketKey

TOKEN = "secret"  # noqa: S105
OURS = {"catalogue": 1, "multiPeer": 1, "tickets": 1, "iceServers": 1, "closeReasons": 1}
STUN = IceServer(urls=("stun:example.org",))
TURN = IceServer(urls=("turn:example.org",), username="u", credential="c")


def verify(ticket: str, prepared: PrepareConnection, keys: tuple[TicketKey, ...]) -> PeerIdentity:
    if ticket != "good" or [key.kid for key in keys] != ["k1"]:
        raise AuthError("not signed", code="auth.bad_ticket")
    return PeerIdentity(prepared.session_id or "", "ann", "Ann", "operator")


def session(token: str | None = TOKEN, max_peers: int = 3) -> RobotSignaling:
    facts = RobotFacts("r1", token, Catalogue.of(()), ice_servers=(STUN,), max_peers=max_peers)
    return RobotSignaling(facts, verify, lambda: 0.0)


def frame(kind: str, data: Any = None) -> FrameReceived:
    return FrameReceived(json.dumps({"type": kind, "data": data}))


def sent(effects: list[Effect]) -> list[dict[str, Any]]:
    return [json.loads(effect.message.to_text()) for effect in effects if isinstance(effect, SendSignal)]


def original(token: str | None = TOKEN) -> RobotSignaling:
    it = session(token)
    it.handle(SocketOpened(), 0.0)
    it.handle(frame("authorize.req"), 0.0)
    it.handle(frame("authorize.res", 100), 0.0)
    assert it.state == "ready"
    return it


def ours(max_peers: int = 3, **without: bool) -> RobotSignaling:
    it = session(max_peers=max_peers)
    extensions = {name: version for name, version in OURS.items() if name not in without}
    it.handle(SocketOpened(), 0.0)
    it.handle(frame("authorize.req", {"extensions": extensions}), 0.0)
    it.handle(frame("authorize.res", 100), 0.0)
    welcome = {"server": "s", "extensions": extensions, "keys": [{"kid": "k1", "x": "x"}]}
    it.handle(frame("session.welcome", {**welcome, "iceServers": [{"urls": ["turn:a"]}]}), 0.0)
    assert it.state == "ready"
    return it


def offer(peer_id: str = "p1", **more: Any) -> FrameReceived:
    return frame("signaling.send_sdp_offer", {"rtcConnectionId": peer_id, "sdpOffer": "sdp", **more})


def prepare(peer_id: str = "p1", **more: Any) -> FrameReceived:
    return frame("signaling.prepare_connection", {"rtcConnectionId": peer_id, **more})


def candidate(peer_id: str = "p1", number: int = 0) -> FrameReceived:
    ice = {"candidate": f"candidate:{number}", "sdpMid": "0", "sdpMLineIndex": 0}
    return frame("signaling.exchange_ice_candidate", {"rtcConnectionId": peer_id, "iceCandidate": ice})


def test_an_original_server_gets_robot_id_and_token_and_status_zero() -> None:
    it = session()
    assert it.handle(SocketOpened(), 0.0) == [ChangeState("connecting")]
    assert sent(it.handle(frame("authorize.req"), 0.0)) == [
        {"type": "authorize", "data": {"robotId": "r1", "data": "secret"}}
    ]
    effects = it.handle(frame("authorize.res", 100), 0.0)
    assert effects[0] == ChangeState("ready")
    assert sent(effects) == [{"type": "status.update", "data": {"status": 0}}]
    assert it.deadline_s is None, "original servers need not ping"


def test_a_robot_without_authorization_sends_only_its_id() -> None:
    it = session(token=None)
    it.handle(SocketOpened(), 0.0)
    assert sent(it.handle(frame("authorize.req"), 0.0))[0]["data"] == {"robotId": "r1"}


def test_our_server_gets_the_extensions_both_know_and_the_catalogue_after_the_welcome() -> None:
    it = session()
    it.handle(SocketOpened(), 0.0)
    answer = sent(it.handle(frame("authorize.req", {"extensions": {**OURS, "tickets": 9, "new": 1}}), 0.0))
    assert answer[0]["data"]["extensions"] == OURS
    assert it.handle(frame("authorize.res", 100), 0.0) == []
    assert it.state == "welcoming"
    effects = it.handle(frame("session.welcome", {"server": "s", "extensions": {"catalogue": 1}}), 0.0)
    # Whoever sees the robot ready may connect at once, and needs the catalogue for that.
    assert [message["type"] for message in sent(effects)] == ["catalogue.announce", "status.update"]
    assert it.agreed == {"catalogue": 1}
    assert it.deadline_s == SILENCE_TIMEOUT_S


def test_a_ping_is_answered_with_its_id() -> None:
    for it in (original(), ours()):
        assert sent(it.handle(frame("ping.ping", {"pingId": "7"}), 1.0)) == [
            {"type": "ping.pong", "data": {"pingId": "7"}}
        ]


def test_silence_of_our_server_closes_the_socket() -> None:
    it = ours()
    it.handle(frame("ping.ping", {"pingId": "7"}), 10.0)
    assert it.handle(DeadlinePassed(), 24.9) == []
    assert it.handle(DeadlinePassed(), 25.0) == [CloseSocket(4408, "signal.timeout")]


def test_a_server_that_never_authorizes_is_given_up() -> None:
    it = session()
    it.handle(SocketOpened(), 5.0)
    assert it.deadline_s == 5.0 + GREETING_TIMEOUT_S
    assert [type(effect) for effect in it.handle(DeadlinePassed(), 15.0)] == [CloseSocket]


@pytest.mark.parametrize(
    ("answer", "code"),
    [
        (frame("authorize.res", 10021), "auth.failed"),
        (frame("authorize", 20001), "auth.unknown_robot"),
        (frame("authorize.res", 2004), "auth.expired"),
        (frame("authorize.res", 10000), "auth.failed"),
        (frame("authorize.res", 424242), "auth.failed"),
    ],
)
def test_refused_credentials_are_reported_once_and_tried_again_slowly(answer: FrameReceived, code: str) -> None:
    it, reports, delays = session(), [], []
    for attempt in range(3):
        it.handle(SocketOpened(), attempt * 100.0)
        it.handle(frame("authorize.req"), attempt * 100.0)
        assert it.handle(answer, attempt * 100.0) == [CloseSocket(1000, code)]
        effects = it.handle(SocketClosed(1000), attempt * 100.0)
        reports += [effect.code for effect in effects if isinstance(effect, Report)]
        delays += [effect.delay_s for effect in effects if isinstance(effect, ReconnectAfter)]
    assert reports == [code]
    assert delays == [30.0, 60.0, 120.0]


def test_a_server_that_is_down_is_reported_once_and_once_when_back() -> None:
    it = session()
    first = it.handle(ConnectFailed("refused"), 0.0)
    second = it.handle(ConnectFailed("refused"), 1.0)
    assert first == [ChangeState("offline"), Report("signal.unreachable", "refused"), ReconnectAfter(0.5)]
    assert second == [ChangeState("offline"), ReconnectAfter(1.0)]
    it.handle(SocketOpened(), 2.0)
    it.handle(frame("authorize.req"), 2.0)
    effects = it.handle(frame("authorize.res", 100), 2.0)
    assert Report("", "The server is there again.") in effects


def test_a_stable_session_that_ends_is_tried_again_quickly_a_short_one_is_not() -> None:
    it = session()
    delays = []
    for start_s, end_s in ((0.0, 1.0), (2.0, 3.0), (4.0, 60.0)):
        it.handle(SocketOpened(), start_s)
        it.handle(frame("authorize.req"), start_s)
        it.handle(frame("authorize.res", 100), start_s)
        effects = it.handle(SocketClosed(1006), end_s)
        delays += [effect.delay_s for effect in effects if isinstance(effect, ReconnectAfter)]
    assert delays == [0.5, 1.0, 0.5]


def test_a_replaced_robot_stops_for_good() -> None:
    it = ours()
    effects = it.handle(SocketClosed(4409), 1.0)
    assert effects[0] == ChangeState("stopped")
    assert not [effect for effect in effects if isinstance(effect, ReconnectAfter)]
    assert it.handle(SocketOpened(), 2.0) == []


def test_close_code_4401_is_tried_again_slowly() -> None:
    effects = ours().handle(SocketClosed(4401), 1.0)
    assert [effect.code for effect in effects if isinstance(effect, Report)] == ["auth.failed"]
    assert "tries again by itself" in next(effect.message for effect in effects if isinstance(effect, Report))
    assert [effect.delay_s for effect in effects if isinstance(effect, ReconnectAfter)] == [30.0]


def test_an_offer_of_an_original_server_starts_a_peer_with_what_waited_for_it() -> None:
    it = original()
    assert it.handle(prepare(), 0.0) == []
    assert it.handle(candidate(number=1), 0.1) == []
    assert it.handle(candidate("stranger"), 0.1) == []
    start, status = it.handle(offer(), 0.2)
    assert isinstance(start, StartPeer)
    assert start.identity == PeerIdentity("p1")
    assert [early.candidate for early in start.candidates] == ["candidate:1"]
    assert start.ice_servers == (STUN,)
    assert sent([status]) == [{"type": "status.update", "data": {"status": 1}}]
    [added] = it.handle(candidate(number=2), 0.3)
    assert isinstance(added, AddCandidate)


def test_an_offer_without_preparation_is_taken_from_an_original_server() -> None:
    assert isinstance(original().handle(offer(), 0.0)[0], StartPeer)


def test_old_spellings_are_understood() -> None:
    it = original()
    it.handle(offer(), 0.0)
    ice = {"candidate": "c", "sdpMid": "0", "sdpMLineIndex": None}
    old = frame("signaling.send_ice_candidate", {"rtcConnectionId": "p1", "iceCandidate": ice})
    assert isinstance(it.handle(old, 0.0)[0], AddCandidate)
    close = frame("signaling.close_connection", {"rtcConnectionId": "p1"})
    assert isinstance(it.handle(close, 0.0)[0], StopPeer)


def statuses(effects: list[Effect]) -> list[int]:
    return [message["data"]["status"] for message in sent(effects) if message["type"] == "status.update"]


def test_the_newest_offer_replaces_after_an_orderly_close() -> None:
    it = original()
    it.handle(offer("p1"), 0.0)
    it.handle(PeerConnected("p1"), 0.0)
    effects = it.handle(offer("p2"), 1.0)
    assert [type(effect) for effect in effects] == [StopPeer, SendSignal, SendSignal, StartPeer, SendSignal]
    assert statuses(effects) == [3, 0, 1]
    assert it.handle(PeerEnded("p1", "peer.replaced"), 1.1) == []


def test_a_peer_that_failed_while_connecting_goes_back_to_zero() -> None:
    it = original()
    it.handle(offer(), 0.0)
    effects = it.handle(PeerEnded("p1", "ice.timeout"), 20.0)
    assert statuses(effects) == [0]
    assert [message["type"] for message in sent(effects)] == ["status.update"], "no keys of ours"


def test_an_operator_that_closes_ends_its_peer() -> None:
    it = original()
    it.handle(offer(), 0.0)
    it.handle(PeerConnected("p1"), 0.0)
    effects = it.handle(frame("signaling.close_peer_connection", {"rtcConnectionId": "p1"}), 1.0)
    assert effects[0] == StopPeer("p1", "peer.closed", was_connected=True)
    assert statuses(effects) == [3, 0]
    assert it.handle(frame("signaling.close_peer_connection", {"rtcConnectionId": "p1"}), 1.0) == []


def test_a_live_peer_survives_the_server_and_shows_in_the_status() -> None:
    it = original()
    it.handle(offer(), 0.0)
    it.handle(PeerConnected("p1"), 0.0)
    lost = it.handle(SocketClosed(1012), 1.0)
    assert not [effect for effect in lost if isinstance(effect, StopPeer)]
    it.handle(SocketOpened(), 2.0)
    it.handle(frame("authorize.req"), 2.0)
    assert statuses(it.handle(frame("authorize.res", 100), 2.0)) == [2]


def good(peer_id: str) -> list[FrameReceived]:
    return [prepare(peer_id, sessionId=f"s-{peer_id}", ticket="good"), offer(peer_id)]


def test_several_operators_with_tickets_fill_the_robot() -> None:
    it, effects = ours(max_peers=2), []
    for peer_id in ("p1", "p2", "p3"):
        for event in (*good(peer_id), PeerConnected(peer_id)):
            effects += it.handle(event, 0.0)
    started = [effect for effect in effects if isinstance(effect, StartPeer)]
    assert [start.identity.session_id for start in started] == ["s-p1", "s-p2"]
    assert started[0].identity.name == "Ann"
    assert started[0].ice_servers == (STUN, IceServer(urls=("turn:a",)))
    assert [(effect.peer_id, effect.code) for effect in effects if isinstance(effect, RefusePeer)] == [
        ("p3", "signal.robot_busy")
    ]
    assert statuses(effects) == [2], "0 while there is capacity"
    assert sent(effects)[-1]["type"] == "signaling.close_peer_connection"
    assert statuses(it.handle(PeerEnded("p1", "peer.closed"), 1.0)) == [0]


def test_whose_place_another_takes_is_told_so_while_it_is_still_being_connected() -> None:
    it = ours(max_peers=2)
    effects = [effect for peer_id in ("p1", "p2", "p3") for event in good(peer_id) for effect in it.handle(event, 0.0)]
    assert [effect.peer_id for effect in effects if isinstance(effect, StopPeer)] == ["p1"]
    [close] = [message for message in sent(effects) if message["type"] == "signaling.close_peer_connection"]
    assert (close["data"]["rtcConnectionId"], close["data"]["code"]) == ("p1", "signal.robot_busy")


@pytest.mark.parametrize("fresh", [(TURN,), ()])
def test_fresh_ice_servers_of_the_preparation_replace_those_of_the_welcome(fresh: tuple[IceServer, ...]) -> None:
    it = ours()
    it.handle(prepare(ticket="good", iceServers=[one.wire() for one in fresh]), 0.0)
    start = it.handle(offer(), 0.0)[0]
    assert isinstance(start, StartPeer)
    assert start.ice_servers == (STUN, *fresh), "the robot's own stay"


@pytest.mark.parametrize("events", [[offer()], [prepare(), offer()], [prepare(ticket="forged"), offer()]])
def test_no_ticket_or_a_bad_one_is_refused_with_its_code(events: list[FrameReceived]) -> None:
    it = ours()
    effects = [effect for event in events for effect in it.handle(event, 0.0)]
    assert not [effect for effect in effects if isinstance(effect, StartPeer)]
    [close] = sent(effects)
    assert close["type"] == "signaling.close_peer_connection"
    assert (close["data"]["rtcConnectionId"], close["data"]["code"]) == ("p1", "auth.bad_ticket")


def test_without_close_reasons_a_refusal_stays_silent() -> None:
    it = ours(closeReasons=True)
    assert sent(it.handle(offer(), 0.0)) == []


def test_a_second_offer_for_a_running_peer_is_refused() -> None:
    it = ours()
    for event in good("p1"):
        it.handle(event, 0.0)
    effects = it.handle(offer("p1"), 0.0)
    assert isinstance(effects[-1], RefusePeer)
    assert sent(effects) == [], "a close would end the running one"


def test_the_end_of_a_peer_reaches_the_operator_unless_it_closed_itself() -> None:
    it = ours()
    for event in [*good("p1"), *good("p2")]:
        it.handle(event, 0.0)
    [told] = sent(it.handle(PeerEnded("p1", "ice.timeout"), 1.0))
    assert told["data"]["code"] == "ice.timeout"
    assert sent(it.handle(PeerEnded("p2", "peer.closed"), 1.0)) == []


def test_an_old_preparation_is_forgotten() -> None:
    it = ours()
    it.handle(prepare(ticket="good"), 0.0)
    assert isinstance(it.handle(offer(), 61.0)[0], SendSignal)


def test_preparations_and_early_candidates_are_bounded() -> None:
    it = original()
    for number in range(100):
        it.handle(prepare(f"p{number}"), 0.0)
    for number in range(200):
        it.handle(candidate("p99", number), 0.0)
    it.handle(candidate("p0"), 0.0)
    start = it.handle(offer("p99"), 0.0)[0]
    assert isinstance(start, StartPeer)
    assert len(start.candidates) == 64


def test_nonsense_is_reported_once_per_connection_and_disturbs_nothing() -> None:
    it = original()
    reports = [effect for _ in range(50) for effect in it.handle(FrameReceived("{"), 0.0)]
    assert [type(report) for report in reports] == [Report]
    assert it.handle(frame("news.flash", {"a": 1}), 0.0) == []
    assert [type(effect) for effect in it.handle(frame("status.update", 10000), 0.0)] == [Report]
    assert it.state == "ready"


def test_what_the_robot_says_while_offline_is_dropped() -> None:
    answer = MessageReady(SdpAnswer(rtc_connection_id="p1", sdp_answer="a"))
    assert session().handle(answer, 0.0) == []
    assert sent(original().handle(answer, 0.0))[0]["data"] == {"rtcConnectionId": "p1", "sdpAnswer": "a"}


def test_shutdown_says_disconnected_and_closes() -> None:
    it = ours()
    effects = it.handle(ShutdownBegun(), 1.0)
    assert statuses(effects) == [5]
    assert effects[-1] == CloseSocket()
    assert it.state == "stopped"
    assert session().handle(ShutdownBegun(), 0.0) == [ChangeState("stopped"), CloseSocket()]


def test_the_token_is_in_no_representation() -> None:
    assert "secret" not in repr(RobotFacts("r1", "secret", Catalogue.of(())))


EVENTS: list[Event] = [
    SocketOpened(),
    ConnectFailed("refused"),
    SocketClosed(1006),
    SocketClosed(4401),
    DeadlinePassed(),
    frame("authorize.req"),
    frame("authorize.req", {"extensions": OURS}),
    frame("authorize.res", 100),
    frame("authorize.res", 10021),
    frame("session.welcome", {"server": "s", "extensions": OURS, "keys": [{"kid": "k1", "x": "x"}]}),
    frame("ping.ping", {"pingId": "1"}),
    *good("p1"),
    *good("p2"),
    candidate("p1"),
    frame("signaling.close_peer_connection", {"rtcConnectionId": "p1"}),
    PeerConnected("p1"),
    PeerEnded("p1", "peer.lost"),
    PeerEnded("p2", "peer.lost"),
    FrameReceived("nonsense"),
]


@given(st.lists(st.tuples(st.sampled_from(EVENTS), st.floats(0, 20)), max_size=60))
def test_over_any_history_nothing_is_said_before_authorization_and_every_wait_is_bounded(
    walk: list[tuple[Event, float]],
) -> None:
    it, now_s, running = session(), 0.0, set()
    for event, step_s in walk:
        now_s += step_s
        for effect in it.handle(event, now_s):
            if isinstance(effect, SendSignal) and it.state != "ready":
                assert effect.message.type in ("authorize", "ping.pong")
            if isinstance(effect, StartPeer):
                assert effect.peer_id not in running
                running.add(effect.peer_id)
            if isinstance(effect, StopPeer):
                running.discard(effect.peer_id)
            if isinstance(effect, Report):
                assert not effect.code or effect.code in REASONS
        if isinstance(event, PeerEnded):
            running.discard(event.peer_id)
        assert it.state in ("offline", "ready") or it.deadline_s is not None or _asked_to_close(it)


def _asked_to_close(it: RobotSignaling) -> bool:
    """After CloseSocket the driver ends the socket, so no deadline is needed."""
    return it.state in ("greeting", "authorizing", "welcoming")


def test_refused_credentials_are_never_rarer_than_every_five_minutes_and_being_let_in_forgets_them() -> None:
    it, now_s = session(), 0.0

    def refused() -> float:
        it.handle(SocketOpened(), now_s)
        it.handle(frame("authorize.req"), now_s)
        it.handle(frame("authorize.res", 10021), now_s)
        (again,) = [one for one in it.handle(SocketClosed(1000), now_s) if isinstance(one, ReconnectAfter)]
        return again.delay_s

    assert [refused() for _ in range(6)] == [30.0, 60.0, 120.0, 240.0, 300.0, 300.0]
    it.handle(SocketOpened(), now_s)
    it.handle(frame("authorize.req"), now_s)
    it.handle(frame("authorize.res", 100), now_s)
    it.handle(SocketClosed(1000), now_s)
    assert refused() == 30.0


def test_another_catalogue_is_announced_at_once_and_to_every_later_server() -> None:
    robot = ours()
    kind, way = MosaicDataType.JSON_R2U, Direction.TO_OPERATOR
    news = Catalogue.of([CatalogueEntry(label="a", type="t", data_type=kind, direction=way)])
    (announced,) = sent(list(robot.handle(CatalogueChanged(news), 1.0)))
    assert announced["type"] == "catalogue.announce"
    assert announced["data"]["catalogue"]["hash"] == news.hash


def test_an_original_server_hears_of_no_catalogue() -> None:
    assert original().handle(CatalogueChanged(Catalogue.of(())), 1.0) == []
