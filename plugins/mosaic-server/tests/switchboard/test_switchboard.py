"""The switchboard's rules, one by one."""

from __future__ import annotations

from typing import Any

import pytest

from mosaic_core.words.catalogue import Catalogue, CatalogueEntry
from mosaic_core.words.codes import CLOSE_REASONS, CloseCode, ResultCode
from mosaic_core.words.data_type import Direction, MosaicDataType
from mosaic_core.words.ice import IceServer
from mosaic_core.words.signaling import (
    EXTENSIONS,
    SIZE_AFTER_AUTHORIZATION,
    AuthorizeResult,
    CatalogueAnnounce,
    CatalogueUpdate,
    ClosePeerConnection,
    ErrorEcho,
    ExchangeIceCandidate,
    IceCandidate,
    OperatorIdentity,
    PingPing,
    PingPong,
    RobotStatus,
    SdpAnswer,
    SdpOffer,
    SessionWelcome,
    SignalingMessage,
    StatusSubscribe,
    StatusUnsubscribe,
    StatusUpdate,
    TicketKey,
    UnknownMessage,
)
from mosaic_server.switchboard import Switchboard
from mosaic_server.switchboard.connection_rules import NEVER_OFFERED_S, ORPHANED_S, PER_ACCOUNT_AND_ROBOT, SESSION_S
from mosaic_server.switchboard.effects import (
    CloseLink,
    ConnectionsMade,
    ConnectionsRefused,
    KeepCatalogue,
    LimitFrames,
    SendToLink,
)
from mosaic_server.switchboard.events import (
    AuthorizationRefused,
    ConnectionsRequested,
    ConnectionsVoid,
    LinkClosed,
    LinkOpened,
    MalformedArrived,
    MessageArrived,
    OperatorAuthorized,
    PingDue,
    RobotAuthorized,
    RobotRemembered,
    RobotRemoved,
    Side,
    SocketCondemned,
    Ticked,
    WantedConnection,
)
from mosaic_server.switchboard.parties import WEDGED_AFTER_S
from mosaic_server.switchboard.voiding import HEARD_AFTER_S

ROBOT = "00000000-0000-4000-8000-000000000001"
ADA = OperatorIdentity(id="ada", name="Ada")
BOB = OperatorIdentity(id="bob", name="Bob")
CANDIDATE = IceCandidate(candidate="c", sdp_mid="0")
CATALOGUE = Catalogue.of(
    [CatalogueEntry(label="b", type="battery", data_type=MosaicDataType.JSON_R2U, direction=Direction.TO_OPERATOR)]
)


class Scene:
    """A switchboard with short names for what happens to it."""

    def __init__(self) -> None:
        self.board = Switchboard()
        self.now_s = 100.0
        self._count = 0

    def opened(self, side: Side) -> int:
        self._count += 1
        self.board.handle(LinkOpened(self._count, side, self.now_s))
        return self._count

    def robot(self, robot_id: str = ROBOT, *, ours: bool = False, organization: str = "org", status: int = 0) -> int:
        socket = self.opened(Side.ROBOT)
        extensions = dict(EXTENSIONS) if ours else {}
        self.board.handle(RobotAuthorized(socket, robot_id, organization, self.now_s, extensions))
        self.says(socket, StatusUpdate(status=status))
        return socket

    def operator(self, who: OperatorIdentity = ADA, *, ours: bool = False, organization: str = "org") -> int:
        socket = self.opened(Side.OPERATOR)
        extensions = dict(EXTENSIONS) if ours else {}
        self.board.handle(OperatorAuthorized(socket, who, organization, self.now_s, extensions))
        return socket

    def says(self, socket: int, message: SignalingMessage, spelled: str | None = None) -> list[Any]:
        """What follows; a refusal names what it refuses."""
        spelled = spelled or message.type
        effects = self.board.handle(MessageArrived(socket, message, spelled, self.now_s))
        for effect in effects:
            if isinstance(effect, SendToLink) and effect.socket == socket and isinstance(effect.message, ErrorEcho):
                assert effect.message.request_type.removesuffix(".res") == spelled
        return effects

    def asks(
        self,
        connection_id: str,
        who: OperatorIdentity = ADA,
        *,
        session_id: str | None = None,
        organization: str = "org",
        robot_id: str = ROBOT,
    ) -> list[Any]:
        wanted = WantedConnection(robot_id, connection_id, session_id or f"session of {connection_id}", "ticket", who)
        return self.board.handle(ConnectionsRequested(who.id, organization, (wanted,), self.now_s))

    def connected(self, operator: int, who: OperatorIdentity = ADA, connection_id: str = "c") -> str:
        assert ConnectionsMade() in self.asks(connection_id, who)
        assert to(self.says(operator, SdpOffer(rtc_connection_id=connection_id, sdp_offer="o"))) != [operator]
        return connection_id

    def void(self, *connection_ids: str, newest: str | None = None) -> list[Any]:
        codes = dict.fromkeys(connection_ids, "auth.role_changed")
        return self.board.handle(ConnectionsVoid(ROBOT, codes, self.now_s, newest))

    def closed(self, socket: int, *, said_goodbye: bool = False) -> list[Any]:
        return self.board.handle(LinkClosed(socket, self.now_s, said_goodbye))

    def passes(self, seconds: float) -> list[Any]:
        self.now_s += seconds
        return self.board.handle(Ticked(self.now_s))


def to(effects: list[Any]) -> list[int]:
    return [effect.socket for effect in effects if isinstance(effect, SendToLink)]


def texts(effects: list[Any]) -> list[tuple[int, Any]]:
    return [(effect.socket, effect.message.envelope()) for effect in effects if isinstance(effect, SendToLink)]


def echoed(effects: list[Any]) -> ResultCode:
    assert len(effects) == 1
    return ResultCode(effects[0].message.code)


@pytest.fixture
def scene() -> Scene:
    return Scene()


def offer(connection_id: str = "c", **more: Any) -> SdpOffer:
    return SdpOffer(rtc_connection_id=connection_id, sdp_offer="o", **more)


def candidate(connection_id: str = "c") -> ExchangeIceCandidate:
    return ExchangeIceCandidate(rtc_connection_id=connection_id, ice_candidate=CANDIDATE)


def close(connection_id: str = "c", **more: Any) -> ClosePeerConnection:
    return ClosePeerConnection(rtc_connection_id=connection_id, **more)


# --- authorization


def test_a_new_socket_is_asked_to_authorize_and_offered_the_extensions() -> None:
    effects = Switchboard().handle(LinkOpened(1, Side.ROBOT, 0.0))
    assert texts(effects) == [(1, {"type": "authorize.req", "data": {"extensions": EXTENSIONS}})]


def test_a_socket_that_does_not_authorize_is_closed_in_time(scene: Scene) -> None:
    socket = scene.opened(Side.OPERATOR)
    assert scene.passes(9.9) == []
    assert scene.passes(0.2) == [CloseLink(socket, CloseCode.TIMEOUT)]


def test_the_last_status_before_authorization_counts_after_it(scene: Scene) -> None:
    socket = scene.opened(Side.ROBOT)
    for status in (2, 0):
        assert scene.says(socket, StatusUpdate(status=status)) == []
    scene.board.handle(RobotAuthorized(socket, ROBOT, "org", scene.now_s))
    robot = scene.board.robot(ROBOT)
    assert robot is not None
    assert robot.status == 0


def test_a_robot_that_authorizes_again_on_its_socket_keeps_its_status(scene: Scene) -> None:
    socket = scene.robot(status=2)
    effects = scene.board.handle(RobotAuthorized(socket, ROBOT, "org", scene.now_s))
    assert not [effect for effect in effects if isinstance(effect, CloseLink)]
    assert scene.board.robot(ROBOT).status == 2  # type: ignore[union-attr]


def test_one_socket_may_change_into_another_robot_and_leaves_the_first(scene: Scene) -> None:
    other = ROBOT[:-1] + "2"
    socket = scene.robot()
    scene.board.handle(RobotAuthorized(socket, other, "org", scene.now_s))
    assert scene.board.robot(ROBOT).status == 5  # type: ignore[union-attr]
    assert scene.board.robot(other).is_online  # type: ignore[union-attr]


def test_welcome_goes_only_to_those_who_know_extensions(scene: Scene) -> None:
    for extensions, expected in (({}, ["authorize.res"]), ({"tickets": 1}, ["authorize.res", "session.welcome"])):
        socket = scene.opened(Side.ROBOT)
        effects = scene.board.handle(RobotAuthorized(socket, ROBOT, "org", scene.now_s, extensions))
        assert [envelope["type"] for number, envelope in texts(effects) if number == socket] == expected


def test_the_welcome_tells_ice_servers_and_keys_to_those_who_know_them() -> None:
    key, ice = TicketKey(kid="k", x="x"), IceServer(urls=("stun:s.example",))
    board = Switchboard(keys=(key,))
    for number, (extensions, ice_servers, keys) in enumerate(
        [({"iceServers": 1}, (ice,), ()), ({"tickets": 1}, (), (key,))]
    ):
        board.handle(LinkOpened(number, Side.OPERATOR, 0.0))
        assert board.handle(OperatorAuthorized(number, ADA, "org", 0.0, extensions, (ice,))) == [
            LimitFrames(number, SIZE_AFTER_AUTHORIZATION),
            SendToLink(number, AuthorizeResult(code=ResultCode.SUCCESS)),
            SendToLink(
                number,
                SessionWelcome(server="mosaic-server", extensions=extensions, ice_servers=ice_servers, keys=keys),
            ),
        ]


def test_a_stranger_is_told_that_it_has_not_logged_in_and_may_answer_pings(scene: Scene) -> None:
    for side, told in ((Side.ROBOT, "catalogue.announce.res"), (Side.OPERATOR, "catalogue.announce")):
        socket = scene.opened(side)
        effects = scene.says(socket, CatalogueAnnounce(catalogue=CATALOGUE))
        assert effects == [SendToLink(socket, ErrorEcho(request_type=told, code=ResultCode.AUTHENTICATION_FAILED))]
        assert scene.says(socket, PingPong(ping_id="id")) == []
    assert echoed(scene.says(socket, StatusUpdate(status=1))) == 10021, "only robots have a status to hold"


def test_nobody_may_refuse_the_server_anything(scene: Scene) -> None:
    for socket in (scene.opened(Side.ROBOT), scene.robot(), scene.operator()):
        assert scene.says(socket, ErrorEcho(request_type="authorize", code=10021)) == []
        assert scene.says(socket, AuthorizeResult(code=ResultCode.SUCCESS)) == []


def test_the_time_to_authorize_is_over_to_the_moment() -> None:
    board = Switchboard(authorize_within_s=4.0)
    board.handle(LinkOpened(1, Side.ROBOT, 0.0))
    assert board.handle(Ticked(3.9)) == []
    assert board.handle(Ticked(4.0)) == [CloseLink(1, CloseCode.TIMEOUT)]


def test_a_status_that_was_held_counts_from_the_log_in_and_for_that_robot_alone(scene: Scene) -> None:
    socket, other = scene.opened(Side.ROBOT), ROBOT[:-1] + "2"
    scene.operator()
    scene.says(socket, StatusUpdate(status=RobotStatus.RTC_CONNECTING))
    scene.board.handle(RobotAuthorized(socket, ROBOT, "org", scene.now_s))
    scene.now_s += WEDGED_AFTER_S - 1
    assert scene.asks("c") == [ConnectionsRefused(ResultCode.ROBOT_NOT_READY_TO_CONNECT, ROBOT)]
    scene.now_s += 1
    assert ConnectionsMade() in scene.asks("c")
    scene.board.handle(RobotAuthorized(socket, other, "org", scene.now_s))
    assert scene.board.robot(other).status is RobotStatus.WS_CONNECTED  # type: ignore[union-attr]


def test_an_operator_that_logs_in_again_on_its_socket_keeps_what_it_has(scene: Scene) -> None:
    robot, socket = scene.robot(), scene.operator()
    scene.says(socket, StatusSubscribe(robot_ids=(ROBOT,)))
    scene.connected(socket)
    scene.board.handle(OperatorAuthorized(socket, ADA, "org", scene.now_s))
    assert to(scene.says(robot, StatusUpdate(status=1))) == [socket]
    assert to(scene.says(robot, candidate())) == [socket]


@pytest.mark.parametrize("ending", ["malformed", "wrong log-ins", "another account", "silence"])
def test_a_connection_outlives_its_operators_socket_for_ten_minutes_however_it_ended(scene: Scene, ending: str) -> None:
    scene.robot(ours=True)
    socket = scene.operator(ours=True)
    scene.connected(socket)
    scene.now_s += 1000
    if ending == "malformed":
        for _ in range(6):
            scene.board.handle(MalformedArrived(socket, None, scene.now_s))
    elif ending == "wrong log-ins":
        for _ in range(5):
            scene.board.handle(AuthorizationRefused(socket, ResultCode.AUTHENTICATION_FAILED, scene.now_s))
    elif ending == "another account":
        scene.board.handle(OperatorAuthorized(socket, BOB, "org", scene.now_s))
        scene.closed(socket)
    else:
        scene.board.handle(SocketCondemned(socket, CloseCode.TIMEOUT, scene.now_s))
    scene.passes(ORPHANED_S)
    assert set(scene.board.book.connections) == {"c"}
    scene.passes(1)
    assert scene.board.book.connections == {}


def test_five_wrong_logins_close_the_socket(scene: Scene) -> None:
    socket = scene.opened(Side.OPERATOR)
    wrong = AuthorizationRefused(socket, ResultCode.AUTHENTICATION_FAILED, scene.now_s)
    for _ in range(4):
        assert texts(scene.board.handle(wrong)) == [(socket, {"type": "authorize.res", "data": 10021})]
    told = SendToLink(socket, AuthorizeResult(code=ResultCode.AUTHENTICATION_FAILED))
    assert scene.board.handle(wrong) == [told, CloseLink(socket, CloseCode.AUTH)]
    assert scene.board.handle(wrong) == []


def test_a_bare_refusal_is_spelled_as_the_original_spells_it(scene: Scene) -> None:
    socket = scene.opened(Side.ROBOT)
    refused = AuthorizationRefused(socket, ResultCode.ROBOT_NOT_FOUND, scene.now_s, bare=True)
    assert texts(scene.board.handle(refused)) == [(socket, {"type": "authorize", "data": 20001})]


def test_malformed_frames_are_echoed_and_then_close_the_socket(scene: Scene) -> None:
    socket = scene.robot()
    spellings = [None, "status.update", "signaling.send_sdp_answer", None, None]
    echoes = [scene.board.handle(MalformedArrived(socket, one, scene.now_s))[0].message for one in spellings]
    assert [(echo.request_type, echo.code) for echo in echoes[:3]] == [
        ("unknown.res", 10001),
        ("status.update.res", 10000),
        ("signaling.send_sdp_answer", 10000),
    ]
    assert scene.board.handle(MalformedArrived(socket, None, scene.now_s))[0] == CloseLink(
        socket, CloseCode.BAD_MESSAGE
    )


def test_pings_go_to_authorized_sockets_only(scene: Scene) -> None:
    assert scene.board.handle(PingDue(scene.opened(Side.ROBOT), "id")) == []
    socket = scene.robot()
    assert scene.board.handle(PingDue(socket, "id")) == [SendToLink(socket, PingPing(ping_id="id"))]


def test_an_account_knows_sessions_if_one_of_its_sockets_says_so(scene: Scene) -> None:
    scene.operator(BOB)
    assert not scene.board.knows_sessions("ada")
    scene.operator(ADA)
    assert not scene.board.knows_sessions("ada")
    scene.operator(ADA, ours=True)
    assert scene.board.knows_sessions("ada")
    assert not scene.board.knows_sessions("bob")


@pytest.mark.parametrize("code", list(CloseCode))
def test_a_socket_is_closed_with_its_codes_own_words(code: CloseCode) -> None:
    assert CloseLink(1, code).reason == CLOSE_REASONS[code]


# --- presence


def test_subscribers_hear_status_at_once_and_on_change_and_when_the_robot_dies(scene: Scene) -> None:
    robot = scene.robot()
    operator = scene.operator()
    news = {"type": "status.update", "data": {"robotId": ROBOT, "status": 0}}
    assert texts(scene.says(operator, StatusSubscribe(robot_ids=(ROBOT,)))) == [(operator, news)]
    assert scene.says(robot, StatusUpdate(status=0)) == [], "no news is no message"
    assert to(scene.says(robot, StatusUpdate(status=1))) == [operator]
    news["data"] = {"robotId": ROBOT, "status": 5}
    assert texts(scene.closed(robot)) == [(operator, news)]


def test_a_subscription_replaces_the_one_before_and_ends(scene: Scene) -> None:
    robot = scene.robot()
    operator = scene.operator()
    scene.says(operator, StatusSubscribe(robot_ids=(ROBOT,)))
    scene.says(operator, StatusSubscribe(robot_ids=()))
    assert scene.says(robot, StatusUpdate(status=1)) == []
    scene.says(operator, StatusSubscribe(robot_ids=(ROBOT,)))
    scene.says(operator, StatusUnsubscribe(robot_ids=(ROBOT,)))
    assert scene.says(robot, StatusUpdate(status=2)) == []


def test_who_is_gone_hears_nothing_and_who_stays_hears_all(scene: Scene) -> None:
    robot = scene.robot()
    first, second, third = scene.operator(), scene.operator(), scene.operator()
    for operator in (first, second, third):
        scene.says(operator, StatusSubscribe(robot_ids=(ROBOT,)))
    scene.closed(first)
    scene.says(second, StatusUnsubscribe(robot_ids=(ROBOT,)))
    assert to(scene.says(robot, StatusUpdate(status=1))) == [third]


def test_operators_that_came_and_went_leave_nothing_behind(scene: Scene) -> None:
    scene.robot()
    empty = repr(vars(scene.board.book))
    for _ in range(3):
        operator = scene.operator()
        scene.says(operator, StatusSubscribe(robot_ids=(ROBOT,)))
        scene.closed(operator)
    assert repr(vars(scene.board.book)) == empty


def test_strangers_learn_nothing_of_a_robot(scene: Scene) -> None:
    robot = scene.robot(ours=True)
    scene.says(robot, CatalogueAnnounce(catalogue=CATALOGUE))
    stranger = scene.operator(BOB, organization="other", ours=True)
    unknown = scene.says(stranger, StatusSubscribe(robot_ids=(ROBOT[:-1] + "9",)))
    foreign = scene.says(stranger, StatusSubscribe(robot_ids=(ROBOT,)))
    nobody = [{"robotId": robot_id, "status": 5} for robot_id in (ROBOT[:-1] + "9", ROBOT)]
    assert [one.message.wire() for one in (*unknown, *foreign)] == nobody
    assert scene.says(robot, StatusUpdate(status=1)) == []


def test_too_many_or_odd_subscriptions_are_refused(scene: Scene) -> None:
    operator = scene.operator()
    for robot_ids in (("nonsense",), tuple(f"00000000-0000-4000-8000-{number:012}" for number in range(1001))):
        assert echoed(scene.says(operator, StatusSubscribe(robot_ids=robot_ids))) == 10000


def test_a_thousand_subscriptions_are_not_too_many(scene: Scene) -> None:
    robot_ids = tuple(f"00000000-0000-4000-8000-{number:012}" for number in range(1000))
    assert len(scene.says(scene.operator(), StatusSubscribe(robot_ids=robot_ids))) == 1000


def test_the_catalogue_is_kept_without_schemas_and_told_to_those_who_know_it(scene: Scene) -> None:
    robot = scene.robot(ours=True)
    ours, original = scene.operator(ours=True), scene.operator()
    for operator in (ours, original):
        scene.says(operator, StatusSubscribe(robot_ids=(ROBOT,)))
    effects = scene.says(robot, CatalogueAnnounce(catalogue=CATALOGUE))
    assert effects[0] == KeepCatalogue(ROBOT, CATALOGUE.short())
    assert effects[1:] == [SendToLink(ours, CatalogueUpdate(robot_id=ROBOT, catalogue=CATALOGUE.short()))]
    assert scene.says(robot, CatalogueAnnounce(catalogue=CATALOGUE)) == []
    scene.closed(robot)
    late = scene.operator(ours=True)
    told = texts(scene.says(late, StatusSubscribe(robot_ids=(ROBOT,))))
    assert [envelope["type"] for _, envelope in told] == ["status.update", "catalogue.update"]


def test_a_catalogue_from_the_database_is_known_before_the_robot_comes(scene: Scene) -> None:
    scene.board.handle(RobotRemembered(ROBOT, "org", CATALOGUE))
    operator = scene.operator(ours=True)
    told = texts(scene.says(operator, StatusSubscribe(robot_ids=(ROBOT,))))
    assert [envelope["type"] for _, envelope in told] == ["status.update", "catalogue.update"]
    robot = scene.robot()
    news = {"type": "status.update", "data": {"robotId": ROBOT, "status": 1}}
    assert texts(scene.says(robot, StatusUpdate(status=1))) == [(operator, news)]


def test_an_original_robot_may_not_announce_a_catalogue(scene: Scene) -> None:
    assert echoed(scene.says(scene.robot(), CatalogueAnnounce(catalogue=CATALOGUE))) == 10002


def test_the_newest_socket_of_a_robot_wins_and_the_old_one_is_told(scene: Scene) -> None:
    old = scene.robot()
    operator = scene.operator()
    scene.says(operator, StatusSubscribe(robot_ids=(ROBOT,)))
    new = scene.opened(Side.ROBOT)
    effects = scene.board.handle(RobotAuthorized(new, ROBOT, "org", scene.now_s))
    assert effects[0] == CloseLink(old, CloseCode.REPLACED)
    assert scene.says(old, StatusUpdate(status=2)) == [], "nothing of the old one counts any more"
    assert scene.board.handle(PingDue(old, "id")) == [], "it is closed"
    assert scene.closed(old) == [], "and its end does not mark the robot as gone"
    assert scene.board.robot(ROBOT).socket == new  # type: ignore[union-attr]


def test_a_removed_robot_loses_its_socket_and_its_connections(scene: Scene) -> None:
    robot, operator = scene.robot(), scene.operator()
    scene.connected(operator)
    assert CloseLink(robot, CloseCode.AUTH) in scene.board.handle(RobotRemoved(ROBOT, scene.now_s))
    assert echoed(scene.says(operator, candidate())) == 10053
    assert scene.board.robot(ROBOT) is None
    assert scene.board.handle(RobotRemoved(ROBOT, scene.now_s)) == [], "there is nothing left to remove"


def test_a_condemned_socket_is_closed_once(scene: Scene) -> None:
    robot = scene.robot()
    condemned = SocketCondemned(robot, CloseCode.TOO_SLOW, scene.now_s)
    assert scene.board.handle(condemned) == [CloseLink(robot, CloseCode.TOO_SLOW)]
    assert scene.board.handle(condemned) == []


# --- making connections


def test_prepare_goes_to_the_robot_before_anything_else(scene: Scene) -> None:
    robot, _ = scene.robot(), scene.operator()
    effects = scene.asks("c")
    assert texts(effects) == [(robot, {"type": "signaling.prepare_connection", "data": {"rtcConnectionId": "c"}})]
    assert effects[-1] == ConnectionsMade()


def test_our_robot_is_told_who_comes(scene: Scene) -> None:
    scene.robot(ours=True)
    scene.operator()
    data = scene.asks("c", session_id="s")[0].message.wire()
    assert data == {
        "rtcConnectionId": "c",
        "sessionId": "s",
        "operator": {"id": "ada", "name": "Ada", "role": "operator", "program": False},
        "ticket": "ticket",
        "iceServers": [],
    }


def test_our_robot_is_told_of_an_operator_who_came_over_its_own_loopback(scene: Scene) -> None:
    scene.robot(ours=True)
    scene.operator()
    wanted = WantedConnection(ROBOT, "c", "s", "ticket", ADA, is_local=True)
    prepare, *_ = scene.board.handle(ConnectionsRequested(ADA.id, "org", (wanted,), scene.now_s))
    assert prepare.message.wire()["isLocal"] is True


def test_refusals_come_in_the_original_order(scene: Scene) -> None:
    assert scene.asks("c") == [ConnectionsRefused(ResultCode.USER_WS_SESSION_NOT_EXIST)]
    operator = scene.operator()
    assert scene.asks("c") == [ConnectionsRefused(ResultCode.ROBOT_WS_SESSION_NOT_EXIST, ROBOT)]
    scene.robot(status=2)
    assert scene.asks("c", organization="other") == [
        ConnectionsRefused(ResultCode.ROBOT_NOT_IN_SAME_ORGANIZATION, ROBOT)
    ]
    scene.closed(operator)
    assert scene.asks("c") == [ConnectionsRefused(ResultCode.ROBOT_NOT_READY_TO_CONNECT, ROBOT)]


def test_all_robots_are_connected_or_none(scene: Scene) -> None:
    other = ROBOT[:-1] + "2"
    scene.robot()
    scene.operator()
    wanted = tuple(WantedConnection(robot_id, robot_id, robot_id, "t", ADA) for robot_id in (ROBOT, other))
    effects = scene.board.handle(ConnectionsRequested(ADA.id, "org", wanted, scene.now_s))
    assert effects == [ConnectionsRefused(ResultCode.ROBOT_WS_SESSION_NOT_EXIST, other)]
    assert scene.board.book.connections == {}


def test_a_wedged_original_robot_is_free_again_after_thirty_seconds(scene: Scene) -> None:
    robot = scene.robot(status=1)
    operator = scene.operator()
    assert scene.asks("a") == [ConnectionsRefused(ResultCode.ROBOT_NOT_READY_TO_CONNECT, ROBOT)]
    scene.passes(29)
    scene.says(robot, StatusUpdate(status=1))
    assert scene.asks("b") == [ConnectionsRefused(ResultCode.ROBOT_NOT_READY_TO_CONNECT, ROBOT)]
    scene.passes(1.1)
    scene.connected(operator)


def test_an_original_robot_never_gets_two_offers_at_once(scene: Scene) -> None:
    robot = scene.robot()
    ada, bob = scene.operator(), scene.operator(BOB)
    assert ConnectionsMade() in scene.asks("a")
    assert scene.asks("b", BOB) == [ConnectionsRefused(ResultCode.ROBOT_NOT_READY_TO_CONNECT, ROBOT)], "reserved"
    scene.passes(10)
    assert ConnectionsMade() in scene.asks("b", BOB), "who asks and never offers does not block the robot"
    assert echoed(scene.says(ada, offer("a"))) in (20007, 10053)
    assert to(scene.says(bob, offer("b"))) == [robot]
    assert echoed(scene.says(bob, offer("b"))) == 20007, "not even its own second one before the robot spoke"
    scene.says(robot, StatusUpdate(status=1))
    assert echoed(scene.says(bob, offer("b"))) == 20007
    scene.says(robot, StatusUpdate(status=2))
    assert echoed(scene.says(bob, offer("b"))) == 20007


def test_asking_again_replaces_ones_own_reservation(scene: Scene) -> None:
    robot, operator = scene.robot(), scene.operator()
    scene.asks("a")
    assert ConnectionsMade() in scene.asks("b")
    assert echoed(scene.says(operator, offer("a"))) == 10053
    assert to(scene.says(operator, offer("b"))) == [robot]


def test_our_robot_takes_several_operators(scene: Scene) -> None:
    robot = scene.robot(ours=True, status=2)
    for name in ("ada", "bob", "eve"):
        who = OperatorIdentity(id=name, name=name)
        socket = scene.operator(who)
        assert ConnectionsMade() in scene.asks(name, who)
        assert to(scene.says(socket, offer(name))) == [robot]
        assert to(scene.says(robot, SdpAnswer(rtc_connection_id=name, sdp_answer="a"))) == [socket]


def test_an_original_robot_that_repeats_that_it_is_ready_stays_kept(scene: Scene) -> None:
    robot = scene.robot()
    scene.operator()
    scene.operator(BOB)
    scene.asks("c")
    scene.says(robot, StatusUpdate(status=0))
    assert scene.asks("d", BOB) == [ConnectionsRefused(ResultCode.ROBOT_NOT_READY_TO_CONNECT, ROBOT)]


def test_a_session_is_claimed_again_by_its_owner_only(scene: Scene) -> None:
    scene.robot(ours=True)
    scene.operator()
    scene.operator(BOB)
    assert ConnectionsMade() in scene.asks("a", session_id="s")
    assert ConnectionsMade() in scene.asks("b", session_id="s")
    assert scene.asks("c", BOB, session_id="s") == [ConnectionsRefused(ResultCode.ACCESS_DENIED, ROBOT)]


def test_a_session_is_its_owners_for_an_hour_after_its_last_connection(scene: Scene) -> None:
    scene.robot(ours=True)
    operator = scene.operator()
    scene.operator(BOB)
    scene.asks("c", session_id="s")
    scene.says(operator, offer())
    scene.passes(3 * SESSION_S)
    scene.says(operator, close())
    scene.passes(SESSION_S)
    assert scene.asks("d", BOB, session_id="s") == [ConnectionsRefused(ResultCode.ACCESS_DENIED, ROBOT)]
    scene.passes(1)
    assert ConnectionsMade() in scene.asks("d", BOB, session_id="s")


@pytest.mark.parametrize(
    ("extensions", "more"),
    [
        ({}, set()),
        ({"iceServers": 1}, set()),
        ({"multiPeer": 1}, {"sessionId", "operator"}),
        ({"tickets": 1}, {"sessionId", "operator", "ticket"}),
        ({"tickets": 1, "iceServers": 1}, {"sessionId", "operator", "ticket", "iceServers"}),
    ],
)
def test_a_robot_is_told_of_an_operator_what_it_knows_to_read(
    scene: Scene, extensions: dict[str, int], more: set[str]
) -> None:
    socket = scene.opened(Side.ROBOT)
    scene.board.handle(RobotAuthorized(socket, ROBOT, "org", scene.now_s, extensions))
    scene.says(socket, StatusUpdate(status=0))
    scene.operator()
    assert set(scene.asks("c")[0].message.wire()) == {"rtcConnectionId"} | more


def test_the_end_of_an_older_connection_does_not_free_a_robot_that_is_kept_for_the_next(scene: Scene) -> None:
    robot, ada = scene.robot(), scene.operator()
    eve = OperatorIdentity(id="eve", name="Eve")
    scene.operator(BOB)
    scene.operator(eve)
    scene.connected(ada)
    for status in (1, 0):
        scene.says(robot, StatusUpdate(status=status))
    assert ConnectionsMade() in scene.asks("d", BOB)
    scene.says(ada, close())
    assert scene.asks("e", eve) == [ConnectionsRefused(ResultCode.ROBOT_NOT_READY_TO_CONNECT, ROBOT)]


def test_connections_that_nobody_closes_do_not_pile_up(scene: Scene) -> None:
    scene.robot(ours=True)
    scene.operator()
    for number in range(3 * PER_ACCOUNT_AND_ROBOT):
        scene.now_s += 1
        assert ConnectionsMade() in scene.asks(str(number))
    assert len(scene.board.book.connections) == PER_ACCOUNT_AND_ROBOT


# --- inside a connection


def test_another_tab_may_not_speak_for_the_first(scene: Scene) -> None:
    scene.robot()
    first, second = scene.operator(), scene.operator()
    scene.connected(first)
    for message in (offer(), candidate(), close()):
        assert echoed(scene.says(second, message)) == 10020


def test_another_account_may_not_even_begin(scene: Scene) -> None:
    scene.robot()
    scene.operator()
    bob = scene.operator(BOB)
    scene.asks("c")
    for message in (offer(), candidate(), close()):
        assert echoed(scene.says(bob, message)) == 10020


def test_candidates_wait_for_the_offer(scene: Scene) -> None:
    robot, operator = scene.robot(), scene.operator()
    scene.asks("c")
    assert echoed(scene.says(operator, candidate())) == 10053
    assert echoed(scene.says(robot, candidate())) == 10053
    assert echoed(scene.says(robot, SdpAnswer(rtc_connection_id="c", sdp_answer="a"))) == 10053


def test_the_next_socket_of_the_account_takes_a_connection_up(scene: Scene) -> None:
    robot, old = scene.robot(), scene.operator()
    scene.connected(old)
    scene.closed(old)
    assert scene.says(robot, candidate()) == [], "between two sockets nothing can be told"
    new = scene.operator()
    assert to(scene.says(new, candidate())) == [robot]
    assert to(scene.says(robot, candidate())) == [new]


def test_a_robot_that_reconnects_still_owns_its_connections(scene: Scene) -> None:
    old, operator = scene.robot(), scene.operator()
    scene.connected(operator)
    scene.closed(old)
    assert echoed(scene.says(operator, candidate())) == 10051
    new = scene.robot()
    assert to(scene.says(new, candidate())) == [operator]
    assert to(scene.says(operator, candidate())) == [new]


@pytest.mark.parametrize("speaker", ["robot", "operator"])
def test_a_connection_is_remembered_for_ten_minutes_after_the_last_word_in_it(scene: Scene, speaker: str) -> None:
    robot, operator = scene.robot(ours=True), scene.operator()
    scene.connected(operator)
    scene.now_s += 1000
    scene.says(robot if speaker == "robot" else operator, candidate())
    scene.closed(robot)
    scene.passes(ORPHANED_S)
    assert set(scene.board.book.connections) == {"c"}
    scene.passes(1)
    assert scene.board.book.connections == {}


def test_only_our_robots_are_told_which_tracks_an_offer_asks_for(scene: Scene) -> None:
    operator = scene.operator()
    for robot_id, ours, tracks in ((ROBOT, True, {"cam": "0"}), (ROBOT[:-1] + "2", False, None)):
        scene.robot(robot_id, ours=ours)
        scene.asks(robot_id, robot_id=robot_id)
        [sent] = scene.says(operator, offer(robot_id, tracks={"cam": "0"}))
        assert (sent.message.sdp_offer, sent.message.tracks) == ("o", tracks)


def test_a_robot_may_not_speak_in_a_connection_of_another(scene: Scene) -> None:
    scene.robot()
    other = scene.robot(ROBOT[:-1] + "2")
    scene.connected(scene.operator())
    for message in (SdpAnswer(rtc_connection_id="c", sdp_answer="a"), candidate(), close()):
        assert echoed(scene.says(other, message)) == 10020


def test_closing_forgets_the_connection(scene: Scene) -> None:
    robot, operator = scene.robot(), scene.operator()
    scene.connected(operator)
    effects = scene.says(operator, close(code="peer.closed", message="bye"))
    assert texts(effects) == [(robot, {"type": "signaling.close_peer_connection", "data": {"rtcConnectionId": "c"}})]
    assert echoed(scene.says(operator, close())) == 10053
    assert ConnectionsMade() in scene.asks("d"), "and frees an original robot"


def test_our_robot_learns_why_and_tells_why(scene: Scene) -> None:
    robot, ours, original = scene.robot(ours=True), scene.operator(ours=True), scene.operator(BOB)
    scene.connected(ours)
    assert scene.says(ours, close(code="peer.closed"))[0].message.code == "peer.closed"
    scene.connected(ours)
    assert to(scene.says(robot, close(code="peer.shutdown"))) == [ours]
    scene.connected(original, BOB, "d")
    assert scene.says(robot, close("d", code="peer.shutdown")) == [], "an original dashboard doesn't know this message"


def test_stale_connections_and_sessions_are_forgotten(scene: Scene) -> None:
    robot, operator = scene.robot(ours=True), scene.operator()
    scene.asks("never offered")
    scene.connected(operator, connection_id="alive")
    scene.passes(NEVER_OFFERED_S)
    assert set(scene.board.book.connections) == {"never offered", "alive"}
    scene.passes(1)
    assert set(scene.board.book.connections) == {"alive"}
    scene.passes(10 * ORPHANED_S)
    assert set(scene.board.book.connections) == {"alive"}
    scene.closed(operator)
    scene.passes(ORPHANED_S + 1)
    assert scene.board.book.connections == {}
    scene.passes(SESSION_S + 1)
    assert scene.board.book.sessions == {}
    assert scene.board.robot(ROBOT).socket == robot  # type: ignore[union-attr]


def test_unknown_words_are_refused_pings_are_not(scene: Scene) -> None:
    for socket in (scene.robot(), scene.operator()):
        told = ErrorEcho(request_type="a.b", code=ResultCode.UNKNOWN_WEBSOCKET_REQUEST_TYPE)
        assert scene.says(socket, UnknownMessage(unknown_type="a.b"), "a.b") == [SendToLink(socket, told)]
        assert echoed(scene.says(socket, UnknownMessage(unknown_type="a.ping"), "a.ping")) == 10002
        for spelled in ("ping", "ping.a"):
            assert scene.says(socket, UnknownMessage(unknown_type=spelled), spelled) == []


def test_another_account_on_the_same_socket_inherits_nothing(scene: Scene) -> None:
    robot, socket = scene.robot(), scene.operator()
    scene.says(socket, StatusSubscribe(robot_ids=(ROBOT,)))
    scene.connected(socket)
    scene.board.handle(OperatorAuthorized(socket, BOB, "org", scene.now_s))
    assert scene.says(robot, StatusUpdate(status=1)) == []
    assert echoed(scene.says(socket, candidate())) == 10020
    assert scene.says(robot, candidate()) == []
    scene.says(robot, StatusUpdate(status=0))
    assert scene.asks("d") == [ConnectionsRefused(ResultCode.USER_WS_SESSION_NOT_EXIST)], "Ada is no longer here"


# --- observers


@pytest.mark.parametrize(("ours", "refused"), [(True, False), (False, True)])
def test_an_observer_connects_only_to_robots_that_know_roles(scene: Scene, ours: bool, refused: bool) -> None:
    """An original robot would let it drive."""
    scene.robot(ours=ours)
    scene.operator()
    effects = scene.asks("c", ADA.model_copy(update={"role": "observer"}))
    refusal = ConnectionsRefused(ResultCode.ACCESS_DENIED, ROBOT, "auth.roles_unknown")
    assert effects == [refusal] if refused else effects[-1] == ConnectionsMade()


# --- connections that no longer hold


def test_a_void_connection_is_closed_at_both_ends_once(scene: Scene) -> None:
    robot, operator = scene.robot(ours=True), scene.operator(ours=True)
    scene.connected(operator)
    told = {"type": "signaling.close_peer_connection", "data": {"rtcConnectionId": "c", "code": "auth.role_changed"}}
    assert texts(scene.void("c")) == [(robot, told), (operator, told)]
    assert scene.void("c") == []
    assert echoed(scene.says(operator, candidate())) == 10053, "nothing is said in it any more"


@pytest.mark.parametrize("is_there", [True, False])
def test_of_a_void_connection_only_operators_are_told_that_are_there_and_know_the_word(
    scene: Scene, is_there: bool
) -> None:
    robot, operator = scene.robot(ours=True), scene.operator(ours=not is_there)
    scene.connected(operator)
    if not is_there:
        scene.closed(operator)
    assert to(scene.void("c")) == [robot]


def test_a_robot_is_told_of_connections_that_the_server_forgot_and_again_when_it_comes_back(scene: Scene) -> None:
    robot = scene.robot(ours=True)
    assert to(scene.void("older than this process")) == [robot]
    scene.closed(robot)
    assert scene.void("older than this process") == [], "it is away"
    again = scene.robot(ours=True)
    assert to(scene.void("older than this process")) == [again]
    assert scene.board.handle(ConnectionsVoid("unknown robot", {"c": "auth.role_changed"}, scene.now_s)) == []


def test_an_original_robot_is_only_told_of_its_newest_connection(scene: Scene) -> None:
    """It would close the one it has, whichever is named."""
    robot = scene.robot()
    close_newest = {"type": "signaling.close_peer_connection", "data": {"rtcConnectionId": "new"}}
    assert scene.void("old", newest=None) == []
    assert texts(scene.void("old", "new", newest="new")) == [(robot, close_newest)]


def test_a_connection_whose_role_changed_while_it_was_made_is_refused(scene: Scene) -> None:
    scene.robot(ours=True)
    scene.operator(ours=True)
    scene.void("c")
    assert scene.asks("c") == [ConnectionsRefused(ResultCode.ACCESS_DENIED, ROBOT)]


def test_what_a_robot_ended_itself_it_has_heard_at_once(scene: Scene) -> None:
    robot, operator = scene.robot(ours=True), scene.operator(ours=True)
    scene.connected(operator)
    scene.says(robot, candidate())
    assert scene.board.heard_by_robots(scene.now_s) == []
    scene.says(robot, close(code="peer.closed"))
    assert scene.board.heard_by_robots(scene.now_s) == ["c"]
    assert scene.board.heard_by_robots(scene.now_s) == []


def test_a_robot_may_end_a_connection_before_its_offer_and_says_nothing_in_one_that_is_not(scene: Scene) -> None:
    robot, operator = scene.robot(ours=True), scene.operator()
    scene.asks("c")
    assert scene.says(robot, close(code="peer.shutdown")) == []
    assert echoed(scene.says(operator, offer())) == 10053
    for message in (answer(), candidate(), close()):
        assert echoed(scene.says(robot, message)) == 10053


def test_what_a_robot_was_told_a_minute_ago_on_the_same_socket_it_has_heard(scene: Scene) -> None:
    robot = scene.robot(ours=True)
    scene.void("a")
    scene.passes(HEARD_AFTER_S - 1)
    scene.void("b")
    assert scene.board.heard_by_robots(scene.now_s) == []
    scene.passes(1)
    assert scene.board.heard_by_robots(scene.now_s) == ["a"]
    assert scene.board.heard_by_robots(scene.now_s) == []
    scene.closed(robot)
    scene.passes(HEARD_AFTER_S)
    assert scene.board.heard_by_robots(scene.now_s) == [], "the socket ended before that is certain"


def test_asking_whether_connections_would_be_refused_changes_nothing(scene: Scene) -> None:
    scene.robot()
    operator = scene.operator()
    asked = ConnectionsRequested("ada", "org", (WantedConnection(ROBOT, "c", "s", "", ADA),), scene.now_s)
    assert scene.board.refusal(asked) is None
    assert scene.board.book.connections == {}
    scene.closed(operator)
    assert scene.board.refusal(asked) == ConnectionsRefused(ResultCode.USER_WS_SESSION_NOT_EXIST)


# --- further offers in a connection that lives


def answer(connection_id: str = "c") -> SdpAnswer:
    return SdpAnswer(rtc_connection_id=connection_id, sdp_answer="a")


@pytest.mark.parametrize(
    ("code", "echo"),
    [
        ("signal.bad_message", 20007),
        ("signal.robot_busy", 20007),
        ("media.no_encoder", 20007),
        ("peer.not_allowed", 20007),
        ("auth.bad_ticket", 10020),
    ],
)
def test_a_refused_second_offer_leaves_the_live_connection_as_it_is(scene: Scene, code: str, echo: int) -> None:
    robot, operator = scene.robot(ours=True), scene.operator(ours=True)
    scene.connected(operator)
    scene.says(robot, answer())
    assert to(scene.says(operator, offer())) == [robot]
    refused = scene.says(robot, close(code=code))
    assert texts(refused) == [(operator, {"type": "signaling.send_sdp_offer", "data": echo})]
    assert to(scene.says(operator, candidate())) == [robot], "what it says is still carried"
    assert to(scene.says(robot, candidate())) == [operator]
    told = scene.says(robot, close(code="signal.timeout"))
    assert told[0].message.code == "signal.timeout", "no offer waits any more: this is the end of the connection"
    assert echoed(scene.says(operator, candidate())) == 10053


def test_a_second_offer_that_is_answered_is_carried_like_the_first(scene: Scene) -> None:
    robot, operator = scene.robot(ours=True), scene.operator(ours=True)
    scene.connected(operator)
    for _ in range(2):
        assert to(scene.says(robot, answer())) == [operator]
        assert to(scene.says(operator, offer())) == [robot]


def test_of_two_offers_in_a_row_the_first_answer_leaves_the_second_waiting(scene: Scene) -> None:
    robot, operator = scene.robot(ours=True), scene.operator(ours=True)
    scene.connected(operator)
    scene.says(operator, offer())
    scene.says(robot, answer())
    assert echoed(scene.says(robot, close(code="signal.bad_message"))) == 20007
    assert to(scene.says(operator, candidate())) == [robot]


def test_when_all_offers_are_answered_the_robots_close_is_the_end_whatever_its_code(scene: Scene) -> None:
    robot, operator = scene.robot(ours=True), scene.operator(ours=True)
    scene.connected(operator)
    scene.says(robot, answer())
    scene.says(operator, offer())
    scene.says(robot, answer())
    assert scene.says(robot, close(code="signal.timeout"))[0].message.code == "signal.timeout"


def test_a_connection_that_ends_while_its_second_offer_waits_has_ended(scene: Scene) -> None:
    robot, operator = scene.robot(ours=True), scene.operator(ours=True)
    scene.connected(operator)
    scene.says(robot, answer())
    scene.says(operator, offer())
    assert scene.says(robot, close(code="peer.lost"))[0].message.code == "peer.lost"
    assert echoed(scene.says(operator, candidate())) == 10053


def test_a_refused_first_offer_ends_the_connection_and_two_quick_ones_are_refused_one_by_one(scene: Scene) -> None:
    robot, operator = scene.robot(ours=True), scene.operator(ours=True)
    scene.connected(operator)
    scene.says(operator, offer())
    assert echoed(scene.says(robot, close(code="signal.bad_message"))) == 20007
    assert isinstance(scene.says(robot, close(code="auth.bad_ticket"))[0].message, ClosePeerConnection)
    assert echoed(scene.says(operator, candidate())) == 10053


def test_an_original_robot_keeps_its_connection_when_a_second_offer_comes(scene: Scene) -> None:
    robot, operator = scene.robot(), scene.operator()
    scene.connected(operator)
    for status in (1, 2):
        scene.says(robot, StatusUpdate(status=status))
    assert echoed(scene.says(operator, offer())) == 20007
    assert to(scene.says(operator, candidate())) == [robot]
    assert texts(scene.says(operator, close())) == [
        (robot, {"type": "signaling.close_peer_connection", "data": {"rtcConnectionId": "c"}})
    ]


def test_a_further_offer_waits_while_an_original_robot_is_kept_for_the_next_connection(scene: Scene) -> None:
    robot, operator = scene.robot(), scene.operator()
    scene.connected(operator)
    for status in (1, 0):
        scene.says(robot, StatusUpdate(status=status))
    scene.asks("d")
    assert echoed(scene.says(operator, offer("c"))) == 20007
    assert to(scene.says(operator, offer("d"))) == [robot]


# --- original operators that leave


def farewell(connection_id: str = "c", **more: Any) -> dict[str, Any]:
    return {"type": "signaling.close_peer_connection", "data": {"rtcConnectionId": connection_id} | more}


def test_a_robot_is_told_at_once_that_an_original_page_was_closed(scene: Scene) -> None:
    robot, operator = scene.robot(ours=True), scene.operator()
    scene.connected(operator)
    assert texts(scene.closed(operator, said_goodbye=True)) == [(robot, farewell(code="peer.closed"))]
    assert scene.passes(60) == []


def test_a_connection_outlives_the_socket_of_its_original_operator(scene: Scene) -> None:
    robot, operator = scene.robot(ours=True), scene.operator()
    scene.connected(operator)
    assert scene.board.handle(LinkClosed(operator, scene.now_s)) == []
    assert to(scene.says(scene.operator(), candidate())) == [robot], "it is taken up again"


def test_an_original_page_that_is_closed_after_its_robot_went_away_tells_nobody(scene: Scene) -> None:
    robot, operator = scene.robot(ours=True), scene.operator()
    scene.connected(operator)
    scene.closed(robot)
    assert scene.closed(operator, said_goodbye=True) == []


def test_a_robot_is_not_told_of_an_operator_that_answers_no_ping(scene: Scene) -> None:
    scene.robot(ours=True)
    operator = scene.operator()
    scene.connected(operator)
    assert to(scene.board.handle(SocketCondemned(operator, CloseCode.TIMEOUT, scene.now_s))) == []
    assert scene.passes(60) == []


def test_an_operator_of_ours_is_its_robots_own_concern(scene: Scene) -> None:
    scene.robot(ours=True)
    operator = scene.operator(ours=True)
    scene.connected(operator)
    assert scene.closed(operator, said_goodbye=True) == []
    assert scene.passes(60) == []


def test_an_original_robot_is_freed_and_told_in_its_own_words(scene: Scene) -> None:
    robot, operator = scene.robot(), scene.operator()
    scene.connected(operator)
    assert texts(scene.closed(operator, said_goodbye=True)) == [(robot, farewell())]
    scene.operator(BOB)
    assert ConnectionsMade() in scene.asks("d", BOB), "the offer that waited for its answer no longer keeps it"


def test_an_original_robot_is_told_of_its_newest_operator_alone(scene: Scene) -> None:
    robot, first = scene.robot(), scene.operator()
    scene.connected(first)
    scene.says(robot, StatusUpdate(status=1))
    scene.says(robot, StatusUpdate(status=0))
    second = scene.operator(BOB)
    scene.connected(second, BOB, "d")
    assert scene.closed(first, said_goodbye=True) == [], "it would close the other's connection"
    assert texts(scene.closed(second, said_goodbye=True)) == [(robot, farewell("d"))]


# --- log-ins that are none


@pytest.mark.parametrize("side", list(Side))
def test_a_log_in_that_is_none_is_answered_on_either_side(scene: Scene, side: Side) -> None:
    socket = scene.opened(side)
    told = scene.board.handle(MalformedArrived(socket, "authorize", scene.now_s))
    assert texts(told) == [(socket, {"type": "authorize.res", "data": 10000})]
