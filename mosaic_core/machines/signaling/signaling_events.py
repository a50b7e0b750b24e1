"""Declares what a signaling session hears (events, past) and what it wants done (effects, imperative)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from mosaic_core.machines.signaling.peer_admission import (
    AddCandidate,
    PeerIdentity,
    RefusePeer,
    RenegotiatePeer,
    StartPeer,
    StopPeer,
)
from mosaic_core.machines.timing.deadline import DeadlinePassed as DeadlinePassed
from mosaic_core.words import signaling as wire
from mosaic_core.words.catalogue import Catalogue
from mosaic_core.words.ice import IceServer


@dataclass(frozen=True, slots=True)
class SocketOpened:
    """The WebSocket is up."""


@dataclass(frozen=True, slots=True)
class ConnectFailed:
    """The WebSocket could not be opened; ``message`` says why."""

    message: str
    code: str = "signal.unreachable"


@dataclass(frozen=True, slots=True)
class FrameReceived:
    """A text frame came from the server."""

    text: str


@dataclass(frozen=True, slots=True)
class SocketClosed:
    """The socket to the server has closed; ``code`` ``None``: without a close frame."""

    code: int | None = None


@dataclass(frozen=True, slots=True)
class NetworkChanged:
    """This machine's network is another one: the socket, if there is one, was dropped and is made anew at once."""


@dataclass(frozen=True, slots=True)
class MessageReady:
    """The robot has something to say: an answer, a candidate, a close."""

    message: wire.SignalingMessage


@dataclass(frozen=True, slots=True)
class PeerConnected:
    """A peer's connection is up."""

    peer_id: str


@dataclass(frozen=True, slots=True)
class PeerEnded:
    """A peer connection is over; ``code`` is told to the operator where that was agreed."""

    peer_id: str
    code: str
    message: str = ""


@dataclass(frozen=True, slots=True)
class ShutdownBegun:
    """The robot stops on purpose."""


@dataclass(frozen=True, slots=True)
class CatalogueChanged:
    """The robot has other connectors than before."""

    catalogue: Catalogue


Event = (
    SocketOpened | ConnectFailed | FrameReceived | SocketClosed | NetworkChanged | DeadlinePassed | MessageReady
    | PeerConnected | PeerEnded | ShutdownBegun | CatalogueChanged
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class SendSignal:
    """Send a signaling message to the server."""

    message: wire.SignalingMessage


@dataclass(frozen=True, slots=True)
class CloseSocket:
    """Close the socket to the server."""

    code: int = 1000
    reason: str = ""


@dataclass(frozen=True, slots=True)
class ReconnectAfter:
    """Opens a socket to the server again after this delay."""

    delay_s: float


@dataclass(frozen=True, slots=True)
class ChangeState:
    """Tells the state of the signaling socket: ``connecting``, ``ready``, ``offline`` or ``stopped``."""

    state: str


@dataclass(frozen=True, slots=True)
class Report:
    """Worth telling a person, once. ``code`` is empty when things are well again."""

    code: str
    message: str


Effect = (
    SendSignal | CloseSocket | ReconnectAfter | ChangeState | Report
    | StartPeer | RenegotiatePeer | StopPeer | AddCandidate | RefusePeer
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class RobotFacts:
    """The facts that a signaling session tells its server about the robot. ``token`` is ``None`` for a robot without
    authorization."""

    robot_id: str
    token: str | None
    catalogue: Catalogue
    ice_servers: tuple[IceServer, ...] = ()
    max_peers: int = 16

    def __repr__(self) -> str:
        return f"RobotFacts(robot_id={self.robot_id!r})"


VerifyTicket = Callable[[str, wire.PrepareConnection, tuple[wire.TicketKey, ...]], PeerIdentity]
"""``(ticket, prepared, keys)`` → who the operator is; raises :class:`AuthError` (``auth.bad_ticket``)."""
