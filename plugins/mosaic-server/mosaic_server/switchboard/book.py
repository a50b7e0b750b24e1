"""The switchboard's book: all parties, with the lookups that every rule needs. No rule lives here."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator

from mosaic_core.words.codes import ResultCode
from mosaic_core.words.signaling import CatalogueUpdate, ErrorEcho, OperatorIdentity, SignalingMessage, StatusUpdate
from mosaic_server.switchboard.effects import Effect, SendToLink
from mosaic_server.switchboard.events import Side
from mosaic_server.switchboard.parties import Connection, KnownRobot, OperatorClaim, Socket


class Book:
    """Plain state; one thread."""

    def __init__(self) -> None:
        self.sockets: dict[int, Socket] = {}
        self.robots: dict[str, KnownRobot] = {}
        self.connections: dict[str, Connection] = {}
        self.sessions: dict[str, OperatorClaim] = {}
        self._listeners: defaultdict[str, set[int]] = defaultdict(set)
        self._signed_in: defaultdict[str, set[int]] = defaultdict(set)

    def sign_in(self, socket: Socket, operator: OperatorIdentity) -> None:
        """This socket speaks for that account from now on."""
        if socket.operator is not None:
            _drop(self._signed_in, socket.operator.id, socket.number)
        socket.operator = operator
        self._signed_in[operator.id].add(socket.number)

    def subscribe(self, socket: Socket, robot_ids: Iterable[str]) -> None:
        """Replaces what the socket hears of."""
        wanted = set(robot_ids)
        for robot_id in socket.subscriptions - wanted:
            _drop(self._listeners, robot_id, socket.number)
        for robot_id in wanted:
            self._listeners[robot_id].add(socket.number)
        socket.subscriptions = wanted

    def forget_socket(self, socket: Socket) -> None:
        del self.sockets[socket.number]
        self.subscribe(socket, ())
        if socket.operator is not None:
            _drop(self._signed_in, socket.operator.id, socket.number)

    def robot_of(self, socket: Socket) -> KnownRobot | None:
        """The robot that speaks on this socket."""
        robot = None if socket.robot_id is None else self.robots.get(socket.robot_id)
        return robot if robot is not None and robot.socket == socket.number else None

    def robot_socket(self, robot_id: str) -> Socket | None:
        robot = self.robots.get(robot_id)
        return None if robot is None or robot.socket is None else self.sockets.get(robot.socket)

    def operator_sockets(self, account_id: str) -> list[Socket]:
        return [self.sockets[number] for number in sorted(self._signed_in.get(account_id, ()))]

    def subscribers(self, robot: KnownRobot) -> Iterator[Socket]:
        """Operators of the robot's organization that want to hear of it."""
        for number in sorted(self._listeners.get(robot.robot_id, ())):
            if self.may_see(self.sockets[number], robot):
                yield self.sockets[number]

    def may_see(self, socket: Socket, robot: KnownRobot) -> bool:
        return socket.organization_id == robot.organization_id

    def status_news(self, robot: KnownRobot) -> list[Effect]:
        news = StatusUpdate(robot_id=robot.robot_id, status=robot.status)
        return [SendToLink(socket.number, news) for socket in self.subscribers(robot)]

    def catalogue_news(self, robot: KnownRobot) -> list[Effect]:
        if robot.catalogue is None:
            return []
        news = CatalogueUpdate(robot_id=robot.robot_id, catalogue=robot.catalogue)
        return [SendToLink(socket.number, news) for socket in self.subscribers(robot) if socket.knows("catalogue")]

    def forget_robot(self, robot_id: str) -> None:
        self.robots.pop(robot_id, None)
        for connection in [one for one in self.connections.values() if one.robot_id == robot_id]:
            del self.connections[connection.connection_id]

    def forget_connection(self, connection: Connection) -> None:
        self.connections.pop(connection.connection_id, None)
        robot = self.robots.get(connection.robot_id)
        if robot and robot.pending and robot.pending.connection_id == connection.connection_id:
            robot.pending = None


def echo(socket: Socket, spelled: str, code: ResultCode, *, res: bool = False) -> list[Effect]:
    """A refusal in the words of the original server: ``.res`` only toward robots (UPSTREAM §1.7)."""
    suffix = ".res" if res and socket.side is Side.ROBOT else ""
    return [SendToLink(socket.number, ErrorEcho(request_type=f"{spelled}{suffix}", code=code))]


def _drop(index: defaultdict[str, set[int]], key: str, number: int) -> None:
    index[key].discard(number)
    if not index[key]:
        del index[key]


def reply(socket: Socket, message: SignalingMessage) -> Effect:
    return SendToLink(socket.number, message)
