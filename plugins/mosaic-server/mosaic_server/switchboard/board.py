"""The switchboard itself: authorization gate, comings and goings of sockets, and dispatch to the rules."""

from __future__ import annotations

from mosaic_core.words.codes import CloseCode, ResultCode
from mosaic_core.words.signaling import (
    EXTENSIONS,
    SIZE_AFTER_AUTHORIZATION,
    Authorize,
    AuthorizeRequest,
    AuthorizeResult,
    ErrorEcho,
    OperatorIdentity,
    PingPing,
    PingPong,
    RobotStatus,
    SessionWelcome,
    StatusUpdate,
    TicketKey,
    UnknownMessage,
)
from mosaic_server.switchboard.book import Book, echo, reply
from mosaic_server.switchboard.connection_rules import connections_requested, forget_stale, refusal
from mosaic_server.switchboard.departures import connections_unbound, operator_left
from mosaic_server.switchboard.effects import CloseLink, ConnectionsRefused, Effect, LimitFrames
from mosaic_server.switchboard.events import (
    AuthorizationRefused,
    ConnectionsRequested,
    ConnectionsVoid,
    Event,
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
)
from mosaic_server.switchboard.operator_rules import operator_says
from mosaic_server.switchboard.parties import KnownRobot, Socket
from mosaic_server.switchboard.robot_rules import robot_says, status_changed
from mosaic_server.switchboard.voiding import connections_void, heard_by_robots

AUTHORIZE_WITHIN_S = 10.0
MALFORMED_ALLOWED = 5
LOGINS_ALLOWED = 5


_OnSocket = (
    LinkClosed
    | SocketCondemned
    | PingDue
    | MalformedArrived
    | MessageArrived
    | AuthorizationRefused
    | RobotAuthorized
    | OperatorAuthorized
)


class Switchboard:
    """Decides which messages go from whom to whom: ``handle(event) -> effects``. Pure; one thread. Events of sockets
    that it closed already are ignored.
    """

    def __init__(
        self,
        *,
        server: str = "mosaic-server",
        keys: tuple[TicketKey, ...] = (),
        authorize_within_s: float = AUTHORIZE_WITHIN_S,
    ) -> None:
        self.book = Book()
        self._server = server
        self._keys = keys
        self._authorize_within_s = authorize_within_s

    def robot(self, robot_id: str) -> KnownRobot | None:
        """What is known of a robot; for REST routes to read."""
        return self.book.robots.get(robot_id)

    def refusal(self, event: ConnectionsRequested) -> ConnectionsRefused | None:
        """Whether the connections would be refused now; changes nothing."""
        return refusal(self.book, event)

    def heard_by_robots(self, now_s: float) -> list[str]:
        """Connections that are over and whose robots know it; each is named once."""
        return heard_by_robots(self.book, now_s)

    def knows_sessions(self, account_id: str) -> bool:
        """Whether a page or program of the account said on its socket that it keeps sessions apart from connections."""
        return any(socket.knows("multiPeer") for socket in self.book.operator_sockets(account_id))

    def handle(self, event: Event) -> list[Effect]:
        match event:
            case ConnectionsRequested():
                return connections_requested(self.book, event)
            case ConnectionsVoid():
                return connections_void(self.book, event)
            case RobotRemembered():
                return self._remembered(event)
            case RobotRemoved():
                return self._robot_removed(event)
            case Ticked(now_s=now_s):
                return self._ticked(now_s)
            case LinkOpened():
                socket = Socket(event.socket, event.side, event.now_s)
                self.book.sockets[event.socket] = socket
                return [reply(socket, AuthorizeRequest(extensions=dict(EXTENSIONS)))]
            case _:
                known = self.book.sockets.get(event.socket)
                return [] if known is None else self._on_socket(known, event)

    def _on_socket(
        self,
        socket: Socket,
        event: _OnSocket,
    ) -> list[Effect]:
        match event:
            case LinkClosed(now_s=now_s, said_goodbye=said_goodbye):
                return self._gone(socket, now_s, said_goodbye=said_goodbye)
            case SocketCondemned(code=code, now_s=now_s):
                return self._close(socket, code, now_s)
            case PingDue(ping_id=ping_id):
                return [reply(socket, PingPing(ping_id=ping_id))] if socket.is_authorized else []
            case MalformedArrived():
                return self._malformed(socket, event)
            case AuthorizationRefused():
                return self._refused(socket, event)
            case RobotAuthorized():
                return self._robot_authorized(socket, event)
            case OperatorAuthorized():
                return self._operator_authorized(socket, event)
            case MessageArrived():
                return self._said(socket, event)

    def _said(self, socket: Socket, event: MessageArrived) -> list[Effect]:
        if isinstance(event.message, UnknownMessage) and event.spelled.split(".")[0] == "ping":
            return []  # the S1 dashboard sends a bare `ping`
        if isinstance(event.message, ErrorEcho | AuthorizeResult):
            return []  # nobody may refuse the server anything; never answer an echo with an echo
        if socket.is_authorized:
            says = robot_says if socket.side is Side.ROBOT else operator_says
            return says(self.book, socket, event)
        if isinstance(event.message, StatusUpdate) and socket.side is Side.ROBOT:
            socket.held_status = event.message.status  # C++ robots repeat it before they authorize (UPSTREAM §1.9 j)
            return []
        if isinstance(event.message, PingPong):
            return []
        return echo(socket, event.spelled, ResultCode.AUTHENTICATION_FAILED, res=True)

    def _malformed(self, socket: Socket, event: MalformedArrived) -> list[Effect]:
        socket.malformed += 1
        if socket.malformed > MALFORMED_ALLOWED:
            return self._close(socket, CloseCode.BAD_MESSAGE, event.now_s)
        if event.spelled == Authorize.type:
            return [reply(socket, AuthorizeResult(code=ResultCode.UNKNOWN_EXCEPTION_OCCURRED))]
        if event.spelled is None:
            return echo(socket, "unknown", ResultCode.INVALID_FORMAT, res=True)
        res = not event.spelled.startswith("signaling.")
        return echo(socket, event.spelled, ResultCode.UNKNOWN_EXCEPTION_OCCURRED, res=res)

    def _refused(self, socket: Socket, event: AuthorizationRefused) -> list[Effect]:
        socket.refused_logins += 1
        answer = (
            ErrorEcho(request_type="authorize", code=event.code) if event.bare else AuthorizeResult(code=event.code)
        )
        if socket.refused_logins < LOGINS_ALLOWED:
            return [reply(socket, answer)]
        return [reply(socket, answer), *self._close(socket, CloseCode.AUTH, event.now_s)]

    def _robot_authorized(self, socket: Socket, event: RobotAuthorized) -> list[Effect]:
        robot = self.book.robots.setdefault(event.robot_id, KnownRobot(event.robot_id, event.organization_id))
        effects = [] if socket.robot_id in (None, event.robot_id) else self._robot_left(socket, event.now_s)
        is_renewal = robot.socket == socket.number
        if robot.socket is not None and not is_renewal:
            self.book.sockets.pop(robot.socket, None)
            effects.append(CloseLink(robot.socket, CloseCode.REPLACED))
        robot.organization_id, robot.socket, robot.extensions = event.organization_id, socket.number, event.extensions
        socket.robot_id, socket.organization_id, socket.extensions = (
            robot.robot_id,
            event.organization_id,
            event.extensions,
        )
        robot.pending, robot.told_over = None, {}
        status = RobotStatus.WS_CONNECTED if socket.held_status is None else socket.held_status
        if is_renewal:
            status = robot.status  # it will not repeat what it said on this very socket
        socket.held_status = None
        return [*effects, *self._welcome(socket, event), *status_changed(self.book, robot, status, event.now_s)]

    def _operator_authorized(self, socket: Socket, event: OperatorAuthorized) -> list[Effect]:
        if not _is_same(socket.operator, event.operator):
            self.book.subscribe(socket, ())
            connections_unbound(self.book, socket, event.now_s)
        self.book.sign_in(socket, event.operator)
        socket.organization_id, socket.extensions = event.organization_id, event.extensions
        return self._welcome(socket, event)

    def _welcome(self, socket: Socket, event: RobotAuthorized | OperatorAuthorized) -> list[Effect]:
        effects = [
            LimitFrames(socket.number, SIZE_AFTER_AUTHORIZATION),
            reply(socket, AuthorizeResult(code=ResultCode.SUCCESS)),
        ]
        if event.extensions:
            ice_servers = event.ice_servers if socket.knows("iceServers") else ()
            keys = self._keys if socket.knows("tickets") else ()
            welcome = SessionWelcome(
                server=self._server, extensions=event.extensions, ice_servers=ice_servers, keys=keys
            )
            effects.append(reply(socket, welcome))
        return effects

    def _remembered(self, event: RobotRemembered) -> list[Effect]:
        robot = self.book.robots.setdefault(event.robot_id, KnownRobot(event.robot_id, event.organization_id))
        robot.catalogue = robot.catalogue or event.catalogue
        return []

    def _robot_removed(self, event: RobotRemoved) -> list[Effect]:
        socket = self.book.robot_socket(event.robot_id)
        effects = [] if socket is None else self._close(socket, CloseCode.AUTH, event.now_s)
        self.book.forget_robot(event.robot_id)
        return effects

    def _ticked(self, now_s: float) -> list[Effect]:
        forget_stale(self.book, now_s)
        late = [
            socket
            for socket in self.book.sockets.values()
            if not socket.is_authorized and now_s - socket.opened_at_s >= self._authorize_within_s
        ]
        return [effect for socket in late for effect in self._close(socket, CloseCode.TIMEOUT, now_s)]

    def _close(self, socket: Socket, code: CloseCode, now_s: float) -> list[Effect]:
        return [CloseLink(socket.number, code), *self._gone(socket, now_s)]

    def _gone(self, socket: Socket, now_s: float, *, said_goodbye: bool = False) -> list[Effect]:
        self.book.forget_socket(socket)
        left = operator_left(self.book, socket, now_s, said_goodbye=said_goodbye)
        return [*left, *self._robot_left(socket, now_s)]

    def _robot_left(self, socket: Socket, now_s: float) -> list[Effect]:
        robot = self.book.robot_of(socket)
        if robot is None:
            return []
        robot.socket, robot.extensions, robot.pending = None, {}, None
        return status_changed(self.book, robot, RobotStatus.DISCONNECTED, now_s)


def _is_same(old: OperatorIdentity | None, new: OperatorIdentity) -> bool:
    return old is not None and old.id == new.id
