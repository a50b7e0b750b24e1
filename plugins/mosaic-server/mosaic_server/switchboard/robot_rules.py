"""Decides what a robot's socket may say: its status, its catalogue, and answers inside its own connections."""

from __future__ import annotations

from mosaic_core.words.codes import ResultCode
from mosaic_core.words.signaling import (
    CatalogueAnnounce,
    ClosePeerConnection,
    ExchangeIceCandidate,
    PingPong,
    RobotStatus,
    SdpAnswer,
    SdpOffer,
    SignalingMessage,
    StatusUpdate,
)
from mosaic_server.switchboard.book import Book, echo
from mosaic_server.switchboard.effects import Effect, KeepCatalogue, SendToLink
from mosaic_server.switchboard.events import MessageArrived
from mosaic_server.switchboard.parties import Connection, KnownRobot, Socket

REFUSALS = ("signal.", "auth.", "media.", "peer.not_allowed")
"""Reason codes of offers that a robot does not take; all others say how a connection ended."""


def robot_says(book: Book, socket: Socket, event: MessageArrived) -> list[Effect]:
    """Effects of one message of an authorized robot."""
    robot = book.robot_of(socket)
    if robot is None:
        return []
    match event.message:
        case StatusUpdate(status=status):
            return status_changed(book, robot, status, event.now_s)
        case CatalogueAnnounce() as announce if "catalogue" in socket.extensions:
            return _announced(book, robot, announce)
        case SdpAnswer() | ExchangeIceCandidate() | ClosePeerConnection():
            return _into_connection(book, robot, socket, event)
        case PingPong():
            return []
        case _:
            return echo(socket, event.spelled, ResultCode.UNKNOWN_WEBSOCKET_REQUEST_TYPE)


def status_changed(book: Book, robot: KnownRobot, status: RobotStatus, now_s: float) -> list[Effect]:
    """Note a robot's status and tell its subscribers, if it is news."""
    if status in (RobotStatus.RTC_CONNECTING, RobotStatus.RTC_CONNECTED):
        robot.pending = None  # the robot itself says now that it is taken
    if status is robot.status:
        return []
    robot.status, robot.status_since_s = status, now_s
    return book.status_news(robot)


def _announced(book: Book, robot: KnownRobot, announce: CatalogueAnnounce) -> list[Effect]:
    catalogue = announce.catalogue.short()
    if catalogue == robot.catalogue:
        return []
    robot.catalogue = catalogue
    return [KeepCatalogue(robot.robot_id, catalogue), *book.catalogue_news(robot)]


def _into_connection(book: Book, robot: KnownRobot, socket: Socket, event: MessageArrived) -> list[Effect]:
    message = event.message
    assert isinstance(message, SdpAnswer | ExchangeIceCandidate | ClosePeerConnection)
    connection = book.connections.get(message.rtc_connection_id)
    if connection is None:
        return echo(socket, event.spelled, ResultCode.WEBRTC_SESSION_NOT_EXIST)
    if connection.robot_id != robot.robot_id:
        return echo(socket, event.spelled, ResultCode.ACCESS_DENIED)
    if not connection.offered and not isinstance(message, ClosePeerConnection):
        return echo(socket, event.spelled, ResultCode.WEBRTC_SESSION_NOT_EXIST)
    connection.used_at_s = event.now_s
    if isinstance(message, SdpAnswer):
        connection.answers = min(connection.answers + 1, connection.offers)
    if isinstance(message, ClosePeerConnection) and _refuses_further_offer(connection, message):
        return _offer_refused(book, connection, message)
    if isinstance(message, ClosePeerConnection):
        robot.said_over.append(connection.connection_id)
    return _toward_operator(book, connection, message)


def _refuses_further_offer(connection: Connection, message: ClosePeerConnection) -> bool:
    code = message.code or ""
    return connection.waits_for_further_answer and code.startswith(REFUSALS)


def _offer_refused(book: Book, connection: Connection, message: ClosePeerConnection) -> list[Effect]:
    """Beside a connection that lives: it goes on, and the operator hears of its offer what the original would say."""
    connection.offers -= 1
    socket = None if connection.socket is None else book.sockets.get(connection.socket)
    if socket is None:
        return []
    is_forbidden = (message.code or "").startswith("auth.")
    code = ResultCode.ACCESS_DENIED if is_forbidden else ResultCode.ROBOT_NOT_READY_TO_CONNECT
    return echo(socket, SdpOffer.type, code)


def _toward_operator(book: Book, connection: Connection, message: SignalingMessage) -> list[Effect]:
    if isinstance(message, ClosePeerConnection):
        book.forget_connection(connection)
    socket = None if connection.socket is None else book.sockets.get(connection.socket)
    if socket is None:
        return []  # the operator is between two sockets; the original says nothing either (code 10050)
    if isinstance(message, ClosePeerConnection) and not socket.knows("closeReasons"):
        return []
    return [SendToLink(socket.number, message)]
