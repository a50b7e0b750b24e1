"""Random parties in random order: a stranger's word never reaches a connection, nothing is reordered or leaked."""

from __future__ import annotations

from typing import Any

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from mosaic_core.words.codes import CloseCode
from mosaic_core.words.signaling import (
    EXTENSIONS,
    CatalogueUpdate,
    ClosePeerConnection,
    ErrorEcho,
    ExchangeIceCandidate,
    IceCandidate,
    OperatorIdentity,
    PrepareConnection,
    SdpAnswer,
    SdpOffer,
    StatusSubscribe,
    StatusUpdate,
)
from mosaic_server.switchboard import Switchboard
from mosaic_server.switchboard.effects import CloseLink, ConnectionsMade, SendToLink
from mosaic_server.switchboard.events import (
    ConnectionsRequested,
    ConnectionsVoid,
    LinkClosed,
    LinkOpened,
    MessageArrived,
    OperatorAuthorized,
    RobotAuthorized,
    Side,
    SocketCondemned,
    Ticked,
    WantedConnection,
)

ROBOTS = {f"00000000-0000-4000-8000-00000000000{n}": "org" if n < 3 else "other" for n in range(4)}
ACCOUNTS = {"ada": "org", "bob": "org", "eve": "other"}
IN_CONNECTION = (SdpOffer, SdpAnswer, ExchangeIceCandidate, ClosePeerConnection, PrepareConnection)
pick = st.integers(0, 1_000_000)


class Parties(RuleBasedStateMachine):
    """The model knows who each socket really is and checks every single effect against it."""

    def __init__(self) -> None:
        super().__init__()
        self.board = Switchboard()
        self.now_s = 0.0
        self.sides: dict[int, Side] = {}
        self.who: dict[int, str] = {}
        self.extensions: dict[int, dict[str, int]] = {}
        self.live: set[int] = set()
        self.owners: dict[str, tuple[str, str]] = {}
        self.delivered: dict[tuple[int, int], list[int]] = {}
        self.void: set[str] = set()
        self.count = 0
        self.relayed = 0

    # --- what may happen

    @rule(side=st.sampled_from(Side))
    def a_socket_opens(self, side: Side) -> None:
        number = len(self.sides) + 1
        self.sides[number] = side
        self.live.add(number)
        self._handle(LinkOpened(number, side, self.now_s))

    @initialize(ours=st.booleans())
    def a_busy_morning(self, ours: bool) -> None:
        """Everybody is there and connected, so that the walk begins where it gets interesting."""
        for name in range(len(ROBOTS)):
            self.a_socket_opens(Side.ROBOT)
            self._authorize(len(self.sides), name, ours)
            self.anybody_reports_a_status(len(self.sides) - 1, 0)
        for name in (0, 0, 1, 2):
            self.a_socket_opens(Side.OPERATOR)
            self._authorize(len(self.sides), name, ours)
        first, second, third, _ = ROBOTS
        self.an_operator_asks_for_connections("ada", {first, second})
        self.an_operator_asks_for_connections("bob", {third})
        for operator, connection in ((4, 0), (4, 1), (6, 2)):
            self.anybody_speaks_in_any_connection(operator, connection, "offer")
        assert self.relayed == 3

    @precondition(lambda self: self.live)
    @rule(which=pick, name=pick, ours=st.booleans())
    def a_socket_authorizes(self, which: int, name: int, ours: bool) -> None:
        self._authorize(self._live(which), name, ours)

    def _authorize(self, socket: int, name: int, ours: bool) -> None:
        self.extensions[socket] = dict(EXTENSIONS) if ours else {}
        if self.sides[socket] is Side.ROBOT:
            robot_id = list(ROBOTS)[name % len(ROBOTS)]
            self.who[socket] = robot_id
            self._handle(RobotAuthorized(socket, robot_id, ROBOTS[robot_id], self.now_s, self.extensions[socket]))
        else:
            account = list(ACCOUNTS)[name % len(ACCOUNTS)]
            self.who[socket] = account
            operator = OperatorIdentity(id=account, name=account)
            self._handle(OperatorAuthorized(socket, operator, ACCOUNTS[account], self.now_s, self.extensions[socket]))

    @rule(account=st.sampled_from(sorted(ACCOUNTS)), robots=st.sets(st.sampled_from(sorted(ROBOTS)), min_size=1))
    def an_operator_asks_for_connections(self, account: str, robots: set[str]) -> None:
        self.count += 1
        who = OperatorIdentity(id=account, name=account)
        wanted = tuple(
            WantedConnection(one, f"{self.count}/{one}", f"s{self.count}/{one}", "t", who) for one in sorted(robots)
        )
        before = dict(self.owners)
        self.owners |= {one.connection_id: (account, one.robot_id) for one in wanted}
        effects = self._handle(ConnectionsRequested(account, ACCOUNTS[account], wanted, self.now_s))
        if ConnectionsMade() not in effects:
            self.owners = before
            assert not any(isinstance(effect, SendToLink) for effect in effects)
        else:
            assert all(ROBOTS[one.robot_id] == ACCOUNTS[account] for one in wanted)

    @precondition(lambda self: self.live and self.owners)
    @rule(which=pick, connection=pick, kind=st.sampled_from(["offer", "answer", "candidate", "close", "refusal"]))
    def anybody_speaks_in_any_connection(self, which: int, connection: int, kind: str) -> None:
        self.count += 1
        socket, connection_id = self._live(which), list(self.owners)[connection % len(self.owners)]
        mark = str(self.count)
        message: Any = {
            "offer": SdpOffer(rtc_connection_id=connection_id, sdp_offer=mark, tracks={"0": "front"}),
            "answer": SdpAnswer(rtc_connection_id=connection_id, sdp_answer=mark),
            "candidate": ExchangeIceCandidate(
                rtc_connection_id=connection_id, ice_candidate=IceCandidate(candidate=mark, sdp_mid="0")
            ),
            "close": ClosePeerConnection(rtc_connection_id=connection_id, code="peer.closed", message=mark),
            "refusal": ClosePeerConnection(rtc_connection_id=connection_id, code="signal.robot_busy", message=mark),
        }[kind]
        effects = self._handle(MessageArrived(socket, message, message.type, self.now_s))
        for effect in effects:
            if isinstance(effect, SendToLink) and not isinstance(effect.message, ErrorEcho | StatusUpdate):
                assert connection_id not in self.void, "nothing is relayed in it any more"
                self._check_relay(socket, connection_id, effect)

    @precondition(lambda self: self.owners)
    @rule(connection=pick)
    def a_role_changes(self, connection: int) -> None:
        connection_id = list(self.owners)[connection % len(self.owners)]
        robot_id = self.owners[connection_id][1]
        self.void.add(connection_id)
        event = ConnectionsVoid(robot_id, {connection_id: "auth.role_changed"}, self.now_s, connection_id)
        self._handle(event)
        assert self._handle(event) == [], "said once"

    @precondition(lambda self: self.live)
    @rule(which=pick, status=st.integers(0, 6))
    def anybody_reports_a_status(self, which: int, status: int) -> None:
        socket = self._live(which)
        self._handle(MessageArrived(socket, StatusUpdate(status=status), "status.update", self.now_s))

    @precondition(lambda self: self.live)
    @rule(which=pick, robots=st.sets(st.sampled_from(sorted(ROBOTS))))
    def anybody_subscribes(self, which: int, robots: set[str]) -> None:
        message = StatusSubscribe(robot_ids=tuple(sorted(robots)))
        self._handle(MessageArrived(self._live(which), message, message.type, self.now_s))

    @precondition(lambda self: self.live)
    @rule(which=pick, ending=st.sampled_from([CloseCode.TOO_SLOW, CloseCode.TIMEOUT, "goodbye", "broken"]))
    def a_socket_ends(self, which: int, ending: CloseCode | str) -> None:
        socket = self._live(which)
        if isinstance(ending, CloseCode):
            self._handle(SocketCondemned(socket, ending, self.now_s))
        else:
            self.live.discard(socket)
            self._handle(LinkClosed(socket, self.now_s, ending == "goodbye"))

    @rule(seconds=st.floats(0.1, 700))
    def time_passes(self, seconds: float) -> None:
        self.now_s += seconds
        self._handle(Ticked(self.now_s))

    # --- what must hold

    @invariant()
    def the_book_is_consistent(self) -> None:
        book = self.board.book
        assert set(book.sockets) == self.live
        for robot in book.robots.values():
            assert robot.socket is None or book.sockets[robot.socket].robot_id == robot.robot_id
            assert robot.is_online or robot.status == 5
        for connection in book.connections.values():
            assert self.owners[connection.connection_id] == (connection.account_id, connection.robot_id)
            assert connection.connection_id not in self.void

    def _handle(self, event: Any) -> list[Any]:
        effects = self.board.handle(event)
        for effect in effects:
            if isinstance(effect, CloseLink):
                assert effect.socket in self.live, "nobody is closed twice"
                self.live.discard(effect.socket)
            elif isinstance(effect, SendToLink):
                assert effect.socket in self.live, "nothing is sent to a closed socket"
                self._check_entitled(effect)
        return effects

    def _check_entitled(self, effect: SendToLink) -> None:
        """Whoever gets a message of a connection or a robot has a right to it, in a form it knows."""
        message, socket = effect.message, effect.socket
        if isinstance(message, StatusUpdate | CatalogueUpdate):
            organization = ACCOUNTS[self.who[socket]]
            if ROBOTS[message.robot_id or ""] != organization:
                assert isinstance(message, StatusUpdate)
                assert message.status == 5, "strangers' robots look as if they never were"
        if isinstance(message, IN_CONNECTION):
            account, robot_id = self.owners[message.rtc_connection_id]
            assert self.who[socket] == (robot_id if self.sides[socket] is Side.ROBOT else account)
            if not self.extensions[socket]:
                assert message.wire().keys() <= {"rtcConnectionId", "sdpOffer", "sdpAnswer", "iceCandidate"}

    def _check_relay(self, sender: int, connection_id: str, effect: SendToLink) -> None:
        account, robot_id = self.owners[connection_id]
        assert self.sides[sender] is not self.sides[effect.socket]
        assert self.who[sender] == (robot_id if self.sides[sender] is Side.ROBOT else account), "a stranger got through"
        order = self.delivered.setdefault((sender, effect.socket), [])
        order.append(self.count)
        assert order == sorted(order)
        self.relayed += 1

    def _live(self, which: int) -> int:
        return sorted(self.live)[which % len(self.live)]


Parties.TestCase.settings = settings(max_examples=60, stateful_step_count=60, deadline=None)
TestParties = Parties.TestCase
