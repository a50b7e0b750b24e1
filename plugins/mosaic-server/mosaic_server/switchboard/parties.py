"""Holds what the switchboard knows of sockets, robots, operators and connections."""

from __future__ import annotations

from dataclasses import dataclass, field

from mosaic_core.words.catalogue import Catalogue
from mosaic_core.words.signaling import OperatorIdentity, RobotStatus
from mosaic_server.switchboard.events import Side

WEDGED_AFTER_S = 30.0
"""Original robots stay in RTC_CONNECTING for ever when ICE fails (UPSTREAM §3.5); after this they count as free."""
RESERVED_FOR_S = 10.0
"""How long a one-operator robot is kept for an operator that asked for a connection and sent no offer yet."""


@dataclass(slots=True)
class Socket:
    """One WebSocket. ``robot_id`` or ``operator`` is set once it is authorized."""

    number: int
    side: Side
    opened_at_s: float
    extensions: dict[str, int] = field(default_factory=dict)
    robot_id: str | None = None
    operator: OperatorIdentity | None = None
    organization_id: str = ""
    held_status: RobotStatus | None = None
    subscriptions: set[str] = field(default_factory=set)
    malformed: int = 0
    refused_logins: int = 0

    @property
    def is_authorized(self) -> bool:
        return self.robot_id is not None or self.operator is not None

    def knows(self, extension: str) -> bool:
        return extension in self.extensions


@dataclass(slots=True)
class Pending:
    """A one-operator robot is spoken for, until ``until_s``."""

    connection_id: str
    account_id: str
    until_s: float
    offered: bool = False


@dataclass(slots=True)
class KnownRobot:
    """A robot, online or remembered."""

    robot_id: str
    organization_id: str
    catalogue: Catalogue | None = None
    socket: int | None = None
    extensions: dict[str, int] = field(default_factory=dict)
    status: RobotStatus = RobotStatus.DISCONNECTED
    status_since_s: float = 0.0
    pending: Pending | None = None
    newest_offer: str | None = None
    """The connection that sent the last offer; a robot of one operator has no other."""
    told_over: dict[str, float] = field(default_factory=dict)
    """Connections that it was told on this socket to close, and when."""
    said_over: list[str] = field(default_factory=list)
    """Connections that it refused or ended itself, until somebody has written that down."""

    @property
    def is_online(self) -> bool:
        return self.socket is not None

    @property
    def takes_several(self) -> bool:
        """It manages its operators itself; originals take one at a time and the server watches over that."""
        return "multiPeer" in self.extensions

    def is_busy(self, now_s: float, account_id: str, connection_id: str | None = None) -> bool:
        """Whether a new connection (or, with ``connection_id``, this connection's offer) must wait."""
        if self.takes_several:
            return False
        if self._is_kept_from(now_s, account_id, connection_id):
            return True
        if self.status is RobotStatus.RTC_CONNECTING:
            return now_s - self.status_since_s < WEDGED_AFTER_S
        return self.status is not RobotStatus.READY_TO_CONNECT

    def _is_kept_from(self, now_s: float, account_id: str, connection_id: str | None) -> bool:
        pending = self.pending
        if pending is None or now_s >= pending.until_s:
            return False
        if pending.offered:
            return True
        if connection_id is not None:
            return pending.connection_id != connection_id
        return pending.account_id != account_id


@dataclass(slots=True)
class Connection:
    """One peer connection in the making or alive; the server only carries its signaling."""

    connection_id: str
    session_id: str
    robot_id: str
    account_id: str
    used_at_s: float
    socket: int | None = None
    """The operator's socket it is bound to: the first that sent an offer, or that took it up after a reconnect."""
    offers: int = 0
    """Those that the robot did not refuse."""
    answers: int = 0

    @property
    def offered(self) -> bool:
        return self.offers > 0

    @property
    def waits_for_further_answer(self) -> bool:
        """There was an offer after the first one: what the robot refuses now is that offer, not the connection."""
        return self.offers > 1 and self.answers < self.offers


@dataclass(slots=True)
class OperatorClaim:
    """One operator page or program on one robot; survives its connections so that it can be claimed again."""

    session_id: str
    robot_id: str
    account_id: str
    used_at_s: float
