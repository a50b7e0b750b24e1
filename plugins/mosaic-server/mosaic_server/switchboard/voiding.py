"""Connections that no longer hold are closed at both ends; a robot that is away hears of it when it comes back."""

from __future__ import annotations

from mosaic_core.words.signaling import ClosePeerConnection
from mosaic_server.switchboard.book import Book
from mosaic_server.switchboard.effects import Effect, SendToLink
from mosaic_server.switchboard.events import ConnectionsVoid
from mosaic_server.switchboard.parties import KnownRobot, Socket

HEARD_AFTER_S = 60.0
"""A socket that lives a minute later has carried what was sent on it: silence for 12 s would have ended it."""


def connections_void(book: Book, event: ConnectionsVoid) -> list[Effect]:
    """The robot is told once per socket, also of connections that the server itself has forgotten."""
    robot = book.robots.get(event.robot_id)
    if robot is None:
        return []
    effects: list[Effect] = []
    for connection_id, code in event.codes.items():
        close = ClosePeerConnection(rtc_connection_id=connection_id, code=code)
        effects += _to_robot(book, robot, close, event) + _to_operator(book, robot, close)
    return effects


def heard_by_robots(book: Book, now_s: float) -> list[str]:
    """Connections that their robots know are over, because they said so or have certainly been told; each is named
    once."""
    heard = []
    for robot in book.robots.values():
        heard += robot.said_over
        robot.said_over.clear()
        old = [one for one, at_s in robot.told_over.items() if robot.is_online and now_s - at_s >= HEARD_AFTER_S]
        for connection_id in old:
            del robot.told_over[connection_id]
        heard += old
    return heard


def _to_robot(book: Book, robot: KnownRobot, close: ClosePeerConnection, event: ConnectionsVoid) -> list[Effect]:
    socket = book.robot_socket(robot.robot_id)
    if socket is None or close.rtc_connection_id in robot.told_over:
        return []
    robot.told_over[close.rtc_connection_id] = event.now_s
    if not robot.takes_several and close.rtc_connection_id != event.newest:
        return []  # originals close the connection they have, whichever is named; the newest one ended this one
    return [SendToLink(socket.number, as_known_to(socket, close))]


def _to_operator(book: Book, robot: KnownRobot, close: ClosePeerConnection) -> list[Effect]:
    connection = book.connections.get(close.rtc_connection_id)
    if connection is None or connection.robot_id != robot.robot_id:
        return []
    book.forget_connection(connection)
    socket = None if connection.socket is None else book.sockets.get(connection.socket)
    return [SendToLink(socket.number, close)] if socket is not None and socket.knows("closeReasons") else []


def as_known_to(socket: Socket, close: ClosePeerConnection) -> ClosePeerConnection:
    """Original robots get exactly the keys of the original protocol."""
    if socket.knows("closeReasons"):
        return close
    return ClosePeerConnection(rtc_connection_id=close.rtc_connection_id)
