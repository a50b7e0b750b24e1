"""Original operators that leave say nothing to their robot, and the robot would wait for them: the server tells it.

Operators of ours need none of this: their robot hears every half second from them, over the connection itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from enum import StrEnum

from mosaic_core.words.signaling import ClosePeerConnection
from mosaic_server.switchboard.book import Book
from mosaic_server.switchboard.effects import Effect, Send
from mosaic_server.switchboard.parties import Connection, Departure, Socket
from mosaic_server.switchboard.voiding import as_known_to

RETURNS_WITHIN_S = 8.0
"""A page whose socket broke may be alive and connected to its robot; the original one tries again after 5 s."""
CERTAIN_AFTER_S = 1.0
"""After a silence. If it was the server's own network, the robot's socket falls silent with the operator's, and nobody
is told of a connection that lives without the server."""


class Farewell(StrEnum):
    """How a socket ended."""

    GOODBYE = "goodbye"
    """The other side closed it: the page was closed or left."""
    BROKEN = "broken"
    SILENT = "silent"
    """It did not answer pings."""


_WAITS_S = {Farewell.GOODBYE: 0.0, Farewell.BROKEN: RETURNS_WITHIN_S, Farewell.SILENT: CERTAIN_AFTER_S}


def operator_left(book: Book, socket: Socket, farewell: Farewell, now_s: float) -> list[Effect]:
    """The operator's connections wait for its next socket; those of an original one do not wait long."""
    for connection in book.connections.values():
        if socket.number not in (connection.socket, connection.returned_on):
            continue
        if connection.socket == socket.number:
            connection.socket, connection.used_at_s = None, now_s
        connection.returned_on = None
        if connection.offered and connection.socket is None and socket.operator is not None and not socket.extensions:
            code = "peer.closed" if farewell is Farewell.GOODBYE else "peer.lost"
            connection.departure = Departure(code, now_s + _WAITS_S[farewell])
    return list(_told(book, now_s)) if farewell is Farewell.GOODBYE else []


def signed_over(book: Book, socket: Socket, now_s: float) -> None:
    """Another account speaks on the socket now; the connections of the one before wait for its next socket."""
    for connection in book.connections.values():
        if connection.socket == socket.number:
            connection.socket, connection.used_at_s = None, now_s


def operator_returned(book: Book, socket: Socket) -> None:
    """A new socket of an account: the page whose socket broke may be behind it."""
    assert socket.operator is not None
    for connection in book.connections.values():
        if connection.departure is not None and connection.account_id == socket.operator.id:
            connection.departure, connection.returned_on = None, socket.number


def departures_due(book: Book, now_s: float) -> list[Effect]:
    """Call as time passes: robots learn of operators that did not come back."""
    return list(_told(book, now_s))


def _told(book: Book, now_s: float) -> Iterator[Effect]:
    for connection in list(book.connections.values()):
        departure = connection.departure
        if departure is not None and now_s >= departure.until_s:
            connection.departure = None
            yield from _to_robot(book, connection, departure.code)


def _to_robot(book: Book, connection: Connection, code: str) -> Iterator[Effect]:
    socket = book.robot_socket(connection.robot_id)
    if socket is None:
        return
    robot = book.robots[connection.robot_id]
    book.forget_connection(connection)
    if robot.takes_several or robot.newest_offer == connection.connection_id:
        # originals close the connection they have, whichever is named
        yield Send(
            socket.number,
            as_known_to(socket, ClosePeerConnection(rtc_connection_id=connection.connection_id, code=code)),
        )
