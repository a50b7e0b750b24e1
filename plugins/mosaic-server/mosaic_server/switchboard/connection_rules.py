"""Decides when a connection may be made, and when it is forgotten."""

from __future__ import annotations

from mosaic_core.words.codes import ResultCode
from mosaic_core.words.signaling import PrepareConnection
from mosaic_server.switchboard.book import Book
from mosaic_server.switchboard.effects import ConnectionsMade, ConnectionsRefused, Effect, SendToLink
from mosaic_server.switchboard.events import ConnectionsRequested, WantedConnection
from mosaic_server.switchboard.parties import RESERVED_FOR_S, Connection, KnownRobot, OperatorClaim, Pending

NEVER_OFFERED_S = 60.0
ORPHANED_S = 600.0
"""How long an operator or robot whose socket went away finds its connection again."""
SESSION_S = 3600.0
PER_ACCOUNT_AND_ROBOT = 16
"""Pages that crash never close; beyond this the oldest connection is forgotten."""


def connections_requested(book: Book, event: ConnectionsRequested) -> list[Effect]:
    """All of the wanted connections, or none and why, in the order of checks of the original server."""
    refused = refusal(book, event)
    if refused is not None:
        return [refused]
    effects: list[Effect] = []
    for wanted in event.wanted:
        robot = book.robots[wanted.robot_id]
        _note(book, robot, wanted, event)
        assert robot.socket is not None
        effects.append(SendToLink(robot.socket, _prepare(robot, wanted)))
    return [*effects, ConnectionsMade()]


def refusal(book: Book, event: ConnectionsRequested) -> ConnectionsRefused | None:
    """Why these connections can't be made now."""
    account_id = event.account_id
    robots = [(wanted.robot_id, book.robots.get(wanted.robot_id)) for wanted in event.wanted]
    for wanted in event.wanted:
        if not _may_use_session(book, wanted, account_id) or _is_over(book, wanted):
            return ConnectionsRefused(ResultCode.ACCESS_DENIED, wanted.robot_id)
    for robot_id, robot in robots:
        if robot is not None and robot.organization_id != event.organization_id:
            return ConnectionsRefused(ResultCode.ROBOT_NOT_IN_SAME_ORGANIZATION, robot_id)
    for robot_id, robot in robots:
        if robot is not None and robot.is_online and robot.is_busy(event.now_s, account_id):
            return ConnectionsRefused(ResultCode.ROBOT_NOT_READY_TO_CONNECT, robot_id)
    if not book.operator_sockets(account_id):
        return ConnectionsRefused(ResultCode.USER_WS_SESSION_NOT_EXIST)
    for robot_id, robot in robots:
        if robot is None or not robot.is_online:
            return ConnectionsRefused(ResultCode.ROBOT_WS_SESSION_NOT_EXIST, robot_id)
    return _unguarded(book, event)


def _unguarded(book: Book, event: ConnectionsRequested) -> ConnectionsRefused | None:
    """A robot without tickets never learns of roles and would let an observer drive."""
    for wanted in event.wanted:
        if wanted.operator.role == "observer" and "tickets" not in book.robots[wanted.robot_id].extensions:
            return ConnectionsRefused(ResultCode.ACCESS_DENIED, wanted.robot_id, "auth.roles_unknown")
    return None


def _may_use_session(book: Book, wanted: WantedConnection, account_id: str) -> bool:
    """A session that nobody knows (the server restarted) may be claimed; another account's or robot's may not."""
    session = book.sessions.get(wanted.session_id)
    return session is None or (session.account_id, session.robot_id) == (account_id, wanted.robot_id)


def _is_over(book: Book, wanted: WantedConnection) -> bool:
    """Its role changed between the signing of the ticket and now."""
    robot = book.robots.get(wanted.robot_id)
    return robot is not None and wanted.connection_id in robot.told_over


def _note(book: Book, robot: KnownRobot, wanted: WantedConnection, event: ConnectionsRequested) -> None:
    account_id = event.account_id
    if robot.pending and not robot.pending.offered and robot.pending.connection_id in book.connections:
        # The same operator asks again: an original robot keeps only the newest id.
        book.forget_connection(book.connections[robot.pending.connection_id])
    _make_room(book, account_id, wanted.robot_id)
    book.connections[wanted.connection_id] = Connection(
        wanted.connection_id, wanted.session_id, wanted.robot_id, account_id, event.now_s
    )
    book.sessions[wanted.session_id] = OperatorClaim(wanted.session_id, wanted.robot_id, account_id, event.now_s)
    if not robot.takes_several:
        robot.pending = Pending(wanted.connection_id, account_id, event.now_s + RESERVED_FOR_S)


def _make_room(book: Book, account_id: str, robot_id: str) -> None:
    mine = [one for one in book.connections.values() if (one.account_id, one.robot_id) == (account_id, robot_id)]
    for oldest in sorted(mine, key=lambda one: one.used_at_s)[: max(0, len(mine) - PER_ACCOUNT_AND_ROBOT + 1)]:
        book.forget_connection(oldest)


def _prepare(robot: KnownRobot, wanted: WantedConnection) -> PrepareConnection:
    extensions = robot.extensions
    if not extensions.keys() & {"tickets", "multiPeer"}:
        return PrepareConnection(rtc_connection_id=wanted.connection_id)
    return PrepareConnection(
        rtc_connection_id=wanted.connection_id,
        session_id=wanted.session_id,
        operator=wanted.operator,
        ticket=wanted.ticket if "tickets" in extensions else None,
        ice_servers=wanted.ice_servers if "iceServers" in extensions else None,
        is_local=wanted.is_local or None,
    )


def forget_stale(book: Book, now_s: float) -> None:
    """Connections and sessions that nobody will ask for again."""
    for connection in list(book.connections.values()):
        idle_s = now_s - connection.used_at_s
        is_alive = connection.socket in book.sockets and book.robot_socket(connection.robot_id) is not None
        if (not connection.offered and idle_s > NEVER_OFFERED_S) or (not is_alive and idle_s > ORPHANED_S):
            book.forget_connection(connection)
    in_use = {connection.session_id for connection in book.connections.values()}
    for session in list(book.sessions.values()):
        if session.session_id in in_use:
            session.used_at_s = now_s
        elif now_s - session.used_at_s > SESSION_S:
            del book.sessions[session.session_id]
