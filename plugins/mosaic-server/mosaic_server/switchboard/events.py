"""Declares what can happen to the switchboard. ``socket`` is a number that its driver gave out and never uses twice."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from mosaic_core.words.catalogue import Catalogue
from mosaic_core.words.codes import CloseCode, ResultCode
from mosaic_core.words.ice import IceServer
from mosaic_core.words.signaling import OperatorIdentity, SignalingMessage


class Side(StrEnum):
    """Which endpoint a socket came in on."""

    ROBOT = "robot"
    OPERATOR = "operator"


@dataclass(frozen=True, slots=True)
class LinkOpened:
    socket: int
    side: Side
    now_s: float


@dataclass(frozen=True, slots=True)
class LinkClosed:
    """The socket is gone, or as good as gone; nothing can be sent on it any more.

    ``said_goodbye``: the other side closed it in the way of the protocol, and not because we did.
    """

    socket: int
    now_s: float
    said_goodbye: bool = False


@dataclass(frozen=True, slots=True)
class MessageArrived:
    """A message that could be read; ``spelled`` is the type as the sender wrote it, for the echo."""

    socket: int
    message: SignalingMessage
    spelled: str
    now_s: float


@dataclass(frozen=True, slots=True)
class MalformedArrived:
    """A frame that could not be read; ``spelled`` is its type if at least that was there."""

    socket: int
    spelled: str | None
    now_s: float


@dataclass(frozen=True, slots=True)
class RobotAuthorized:
    """The driver checked the credentials: this socket is that robot. ``extensions`` are the agreed ones."""

    socket: int
    robot_id: str
    organization_id: str
    now_s: float
    extensions: dict[str, int] = field(default_factory=dict)
    ice_servers: tuple[IceServer, ...] = ()


@dataclass(frozen=True, slots=True)
class OperatorAuthorized:
    """The driver checked the access token: this socket is that account."""

    socket: int
    operator: OperatorIdentity
    organization_id: str
    now_s: float
    extensions: dict[str, int] = field(default_factory=dict)
    ice_servers: tuple[IceServer, ...] = ()


@dataclass(frozen=True, slots=True)
class AuthorizationRefused:
    """A robot's or operator's authorization is refused. ``bare`` answers with type ``authorize`` instead of
    ``authorize.res``, as the original does for 20001.
    """

    socket: int
    code: ResultCode
    now_s: float
    bare: bool = False


@dataclass(frozen=True, slots=True)
class WantedConnection:
    """One connection that an operator asked for, with fresh ids, a signed ticket, and the role on this robot."""

    robot_id: str
    connection_id: str
    session_id: str
    ticket: str
    operator: OperatorIdentity
    ice_servers: tuple[IceServer, ...] = ()
    """With credentials for this robot."""
    is_local: bool = False
    """The operator asked over this machine's loopback."""


@dataclass(frozen=True, slots=True)
class ConnectionsRequested:
    """All or none. The driver checked that the robots exist and belong to the operator's organization."""

    account_id: str
    organization_id: str
    wanted: tuple[WantedConnection, ...]
    now_s: float


@dataclass(frozen=True, slots=True)
class ConnectionsVoid:
    """The driver found that these no longer hold: id → reason code. They may be older than this process.

    ``newest``: the one of them that is the newest of all connections of this robot, if it is among them.
    """

    robot_id: str
    codes: Mapping[str, str]
    now_s: float
    newest: str | None = None


@dataclass(frozen=True, slots=True)
class RobotRemembered:
    """A robot from the database with the catalogue that it last announced."""

    robot_id: str
    organization_id: str
    catalogue: Catalogue | None = None


@dataclass(frozen=True, slots=True)
class RobotRemoved:
    """The robot is no longer in the database."""

    robot_id: str
    now_s: float


@dataclass(frozen=True, slots=True)
class SocketCondemned:
    """The driver found a reason to close it: silence, too many messages, credentials that were revoked."""

    socket: int
    code: CloseCode
    now_s: float


@dataclass(frozen=True, slots=True)
class PingDue:
    """Time for the original protocol's own ping; ``ping_id`` is a fresh UUID."""

    socket: int
    ping_id: str


@dataclass(frozen=True, slots=True)
class Ticked:
    """Time passed; about once a second."""

    now_s: float


Event = (
    LinkOpened
    | LinkClosed
    | MessageArrived
    | MalformedArrived
    | RobotAuthorized
    | OperatorAuthorized
    | AuthorizationRefused
    | ConnectionsRequested
    | ConnectionsVoid
    | RobotRemembered
    | RobotRemoved
    | SocketCondemned
    | PingDue
    | Ticked
)
