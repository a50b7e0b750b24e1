"""Original pages that are closed say nothing to their robot, and the robot would wait for them: the server tells it.

Nobody else is told of. A socket that broke says nothing of the connection beside it, which lives without the server;
a robot of ours notices within 16 s by itself that an original operator has vanished.
"""

from __future__ import annotations

from collections.abc import Iterator

from mosaic_core.words.signaling import ClosePeerConnection
from mosaic_server.switchboard.book import Book
from mosaic_server.switchboard.effects import Effect, SendToLink
from mosaic_server.switchboard.parties import Connection, Socket
from mosaic_server.switchboard.voiding import as_known_to


def connections_unbound(book: Book, socket: Socket, now_s: float) -> list[Connection]:
    """The connections that this socket carried wait for the next socket of their account from now on."""
    unbound = [one for one in book.connections.values() if one.socket == socket.number]
    for connection in unbound:
        connection.socket, connection.used_at_s = None, now_s
    return unbound


def operator_left(book: Book, socket: Socket, now_s: float, *, said_goodbye: bool) -> list[Effect]:
    """``said_goodbye``: its page was closed or left, so that an original one takes its connections with it."""
    unbound = connections_unbound(book, socket, now_s)
    if not said_goodbye or socket.extensions:
        return []
    return [effect for connection in unbound if connection.offered for effect in _to_robot(book, connection)]


def _to_robot(book: Book, connection: Connection) -> Iterator[Effect]:
    socket = book.robot_socket(connection.robot_id)
    if socket is None:
        return
    robot = book.robots[connection.robot_id]
    book.forget_connection(connection)
    if robot.takes_several or robot.newest_offer == connection.connection_id:
        # originals close the connection they have, whichever is named
        over = ClosePeerConnection(rtc_connection_id=connection.connection_id, code="peer.closed")
        yield SendToLink(socket.number, as_known_to(socket, over))
