"""The operator's signaling session: toward our server, toward an original one, and when things go wrong."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mosaic_core.machines.signaling.operator_signaling import Deliver, Effect, OperatorSignaling, RobotsWatched
from mosaic_core.machines.signaling.signaling_events import (
    ChangeState,
    CloseSocket,
    ConnectFailed,
    DeadlinePassed,
    FrameReceived,
    ReconnectAfter,
    Report,
    SendSignal,
    SocketClosed,
    SocketOpened,
)
from mosaic_core.words.signaling import EXTENSIONS


def frame(kind: str, data: object = None) -> FrameReceived:
    return FrameReceived(json.dumps({"type": kind, "data": data}))


def sent(effects: list[Effect]) -> list[dict[str, object]]:
    return [json.loads(effect.message.to_text()) for effect in effects if isinstance(effect, SendSignal)]


def ready_session(*, original: bool = False) -> OperatorSignaling:
    session = OperatorSignaling("jwt", lambda: 0.0)
    session.handle(SocketOpened(), 0.0)
    session.handle(frame("authorize.req", None if original else {"extensions": EXTENSIONS}), 0.0)
    session.handle(frame("authorize.res", 100), 0.0)
    if not original:
        session.handle(frame("session.welcome", {"server": "x", "extensions": EXTENSIONS}), 0.0)
    assert session.state == "ready"
    return session


def test_toward_an_original_server_exactly_its_keys_are_sent() -> None:
    session = OperatorSignaling("jwt", lambda: 0.0)
    session.handle(SocketOpened(), 0.0)
    assert sent(session.handle(frame("authorize.req"), 0.0)) == [{"type": "authorize", "data": {"accessToken": "jwt"}}]
    assert session.handle(frame("authorize.res", 100), 0.0) == [ChangeState("ready")]
    assert session.agreed == {}
    assert session.deadline_s is None  # it pings as it likes


def test_toward_our_server_extensions_are_accepted_and_the_welcome_awaited() -> None:
    session = OperatorSignaling("jwt", lambda: 0.0)
    session.handle(SocketOpened(), 0.0)
    offered = {"extensions": {"catalogue": 7, "tickets": 1, "unheard": 3}}
    ((answer),) = sent(session.handle(frame("authorize.req", offered), 0.0))
    assert answer["data"] == {"accessToken": "jwt", "extensions": {"catalogue": 1, "tickets": 1}}
    assert session.handle(frame("authorize.res", 100), 0.0) == []
    welcome = {"server": "x", "extensions": {"catalogue": 1}}
    assert session.handle(frame("session.welcome", welcome), 0.0) == [ChangeState("ready")]
    assert session.agreed == {"catalogue": 1}


def test_subscriptions_are_sent_again_after_every_reconnection() -> None:
    session = ready_session(original=True)
    expected = [{"type": "status.subscribe", "data": {"robotIds": ["a", "b"]}}]
    assert sent(session.handle(RobotsWatched(("a", "b", "a")), 0.0)) == expected
    session.handle(SocketClosed(1006), 1.0)
    assert session.handle(RobotsWatched(("a", "b")), 1.0) == []
    session.handle(SocketOpened(), 2.0)
    session.handle(frame("authorize.req"), 2.0)
    assert sent(session.handle(frame("authorize.res", 100), 2.0)) == expected


def test_pings_are_answered_in_every_state() -> None:
    session = OperatorSignaling("jwt", lambda: 0.0)
    session.handle(SocketOpened(), 0.0)
    ping = frame("ping.ping", {"pingId": "p"})
    for each in (session, ready_session()):
        assert sent(each.handle(ping, 1.0)) == [{"type": "ping.pong", "data": {"pingId": "p"}}]


@pytest.mark.parametrize(("code", "word"), [(10021, "auth.failed"), (2004, "auth.expired"), (999999, "auth.failed")])
@pytest.mark.parametrize("kind", ["authorize.res", "authorize"])
def test_a_refused_token_stops_for_good(code: int, word: str, kind: str) -> None:
    session = OperatorSignaling("jwt", lambda: 0.0)
    session.handle(SocketOpened(), 0.0)
    session.handle(frame("authorize.req"), 0.0)
    effects = session.handle(frame(kind, code), 0.0)
    assert session.state == "stopped"
    assert [effect.code for effect in effects if isinstance(effect, Report)] == [word]
    assert any(isinstance(effect, CloseSocket) for effect in effects)
    assert session.handle(SocketClosed(1000), 1.0) == []


def test_a_lost_server_is_reported_once_and_tried_again_ever_later() -> None:
    session = OperatorSignaling("jwt", lambda: 0.0)
    waits, reports = [], 0
    for _ in range(8):
        effects = session.handle(ConnectFailed("nothing answers"), 0.0)
        waits += [effect.delay_s for effect in effects if isinstance(effect, ReconnectAfter)]
        reports += sum(isinstance(effect, Report) for effect in effects)
    assert waits == sorted(waits)
    assert waits[-1] == 30.0
    assert reports == 1


def test_a_silent_socket_is_closed() -> None:
    session = ready_session()
    assert session.handle(DeadlinePassed(), 14.0) == []
    assert session.handle(DeadlinePassed(), 15.0) == [CloseSocket(4408, "signal.timeout")]


def test_messages_reach_the_operator_only_while_ready_and_nonsense_never() -> None:
    session = ready_session()
    update = frame("status.update", {"robotId": "a", "status": 0})
    (delivered,) = session.handle(update, 1.0)
    assert isinstance(delivered, Deliver)
    assert session.handle(FrameReceived("nonsense"), 1.0) == []
    session.handle(SocketClosed(4401), 2.0)
    assert session.state == "stopped"


@given(
    st.lists(
        st.sampled_from([
            SocketOpened(), SocketClosed(1006), SocketClosed(4409), SocketClosed(4401), ConnectFailed("x"),
            DeadlinePassed(), frame("authorize.req"), frame("authorize.req", {"extensions": EXTENSIONS}),
            frame("authorize.res", 100), frame("authorize.res", 10021), frame("ping.ping", {"pingId": "1"}),
            frame("session.welcome", {"server": "s", "extensions": EXTENSIONS}), FrameReceived("["),
        ]),
        max_size=40,
    )
)  # fmt: skip
def test_a_random_walk_never_sends_the_token_unasked(walk: list[object]) -> None:
    session = OperatorSignaling("secret-jwt", lambda: 0.0)
    for now_s, event in enumerate(walk):
        effects = session.handle(event, float(now_s))  # type: ignore[arg-type]
        told = any("secret-jwt" in str(message) for message in sent(effects))
        asked = isinstance(event, FrameReceived) and "authorize.req" in event.text
        assert not told or asked
        assert all("secret-jwt" not in effect.message for effect in effects if isinstance(effect, Report))
