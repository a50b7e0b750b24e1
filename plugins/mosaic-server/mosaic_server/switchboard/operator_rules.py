"""Decides what an operator's socket may say: subscriptions, and offers, candidates and closing in connections of its
account.

A connection is bound to the socket that sends the first offer. When that socket is gone, another one of the same
account takes the connection up by speaking in it.
"""

from __future__ import annotations

from collections.abc import Iterable

from mosaic_core.words.codes import ResultCode
from mosaic_core.words.signaling import (
    CatalogueUpdate,
    ClosePeerConnection,
    ExchangeIceCandidate,
    PingPong,
    RobotStatus,
    SdpOffer,
    StatusSubscribe,
    StatusUnsubscribe,
    StatusUpdate,
)
from mosaic_server.ids import is_uuid
from mosaic_server.switchboard.book import Book, echo, reply
from mosaic_server.switchboard.effects import Effect, SendToLink
from mosaic_server.switchboard.events import MessageArrived
from mosaic_server.switchboard.parties import WEDGED_AFTER_S, Connection, KnownRobot, Pending, Socket

MAX_SUBSCRIPTIONS = 1000

_InConnection = SdpOffer | ExchangeIceCandidate | ClosePeerConnection


def operator_says(book: Book, socket: Socket, event: MessageArrived) -> list[Effect]:
    """Effects of one message of an authorized operator."""
    match event.message:
        case SdpOffer() | ExchangeIceCandidate() | ClosePeerConnection() as message:
            return _in_connection(book, socket, event, message)
        case StatusSubscribe(robot_ids=robot_ids):
            return _subscribed(book, socket, event, robot_ids)
        case StatusUnsubscribe(robot_ids=robot_ids):
            book.subscribe(socket, socket.subscriptions - set(robot_ids))
            return []
        case PingPong():
            return []
        case _:
            return echo(socket, event.spelled, ResultCode.UNKNOWN_WEBSOCKET_REQUEST_TYPE)


def _subscribed(book: Book, socket: Socket, event: MessageArrived, robot_ids: Iterable[str]) -> list[Effect]:
    wanted = list(dict.fromkeys(robot_ids))
    if len(wanted) > MAX_SUBSCRIPTIONS or not all(map(is_uuid, wanted)):
        return echo(socket, event.spelled, ResultCode.UNKNOWN_EXCEPTION_OCCURRED)
    book.subscribe(socket, wanted)
    return [effect for robot_id in wanted for effect in _present(book, socket, robot_id)]


def _present(book: Book, socket: Socket, robot_id: str) -> list[Effect]:
    """What is known now; a robot of strangers looks exactly like one that never was."""
    robot = book.robots.get(robot_id)
    if robot is None or not book.may_see(socket, robot):
        return [reply(socket, StatusUpdate(robot_id=robot_id, status=RobotStatus.DISCONNECTED))]
    effects = [reply(socket, StatusUpdate(robot_id=robot_id, status=robot.status))]
    if robot.catalogue is not None and socket.knows("catalogue"):
        effects.append(reply(socket, CatalogueUpdate(robot_id=robot_id, catalogue=robot.catalogue)))
    return effects


def _in_connection(book: Book, socket: Socket, event: MessageArrived, message: _InConnection) -> list[Effect]:
    connection = book.connections.get(message.rtc_connection_id)
    if connection is None:
        return echo(socket, event.spelled, ResultCode.WEBRTC_SESSION_NOT_EXIST)
    if not _may_speak(book, socket, connection):
        return echo(socket, event.spelled, ResultCode.ACCESS_DENIED)
    if not connection.offered and isinstance(message, ExchangeIceCandidate):
        return echo(socket, event.spelled, ResultCode.WEBRTC_SESSION_NOT_EXIST)
    robot = book.robots[connection.robot_id]
    connection.used_at_s = event.now_s
    if isinstance(message, ClosePeerConnection):
        book.forget_connection(connection)
    if robot.socket is None:
        return echo(socket, event.spelled, ResultCode.ROBOT_WS_SESSION_NOT_EXIST)
    if isinstance(message, SdpOffer):
        if robot.is_busy(event.now_s, connection.account_id, connection.connection_id):
            return echo(socket, event.spelled, ResultCode.ROBOT_NOT_READY_TO_CONNECT)
        _note_offer(robot, connection, event.now_s)
    connection.socket = socket.number
    return [SendToLink(robot.socket, _as_known_to(robot, message))]


def _may_speak(book: Book, socket: Socket, connection: Connection) -> bool:
    """The account's, and not while another live socket (another tab) holds it."""
    if socket.operator is None or socket.operator.id != connection.account_id:
        return False
    return connection.socket in (None, socket.number) or connection.socket not in book.sockets


def _note_offer(robot: KnownRobot, connection: Connection, now_s: float) -> None:
    connection.offers += 1
    robot.newest_offer = connection.connection_id
    if not robot.takes_several:
        until_s = now_s + WEDGED_AFTER_S
        robot.pending = Pending(connection.connection_id, connection.account_id, until_s, offered=True)


def _as_known_to(robot: KnownRobot, message: _InConnection) -> _InConnection:
    """Original robots get exactly the keys of the original protocol."""
    if isinstance(message, SdpOffer) and "catalogue" not in robot.extensions:
        return message.model_copy(update={"tracks": None})
    if isinstance(message, ClosePeerConnection) and "closeReasons" not in robot.extensions:
        return ClosePeerConnection(rtc_connection_id=message.rtc_connection_id)
    return message
