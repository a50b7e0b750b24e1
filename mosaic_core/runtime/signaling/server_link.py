"""Connects the robot to one of the servers that introduce operators to it: its session, its peers, and ids unlike those
of any other.

A robot may know several (its fleet's and the one that it runs itself). Each checks tickets with its own keys, and what
one says of a peer or an operator never touches those of another.
"""

from __future__ import annotations

import asyncio
import logging
import random
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol
from urllib.parse import urlsplit

from mosaic_core.contract.host import Sender
from mosaic_core.machines.peers.home_address import is_loopback_name
from mosaic_core.machines.peers.network_change import NetworkChange
from mosaic_core.machines.signaling import signaling_events as events
from mosaic_core.machines.signaling.peer_admission import AddCandidate, RefusePeer, RenegotiatePeer, StartPeer, StopPeer
from mosaic_core.machines.signaling.robot_signaling import RobotSignaling
from mosaic_core.machines.timing.pacing import ComplaintPace
from mosaic_core.runtime.observation.counters import ServerSnapshot
from mosaic_core.runtime.signaling.signaling_socket import SignalingSocket
from mosaic_core.runtime.signaling.tickets import TicketVerifier
from mosaic_core.runtime.transport.transport import SocketConnector
from mosaic_core.words.catalogue import Catalogue
from mosaic_core.words.codes import reason
from mosaic_core.words.config import ServerConfig
from mosaic_core.words.errors import SignalingError
from mosaic_core.words.signaling import IceCandidate, SignalingMessage

logger = logging.getLogger(__name__)

REFUSALS_TOLD_S = 10.0
"""Refused operators come again: the log tells of each kind of refusal at most this often."""
FLEET = "fleet"
LAN = "lan"


@dataclass(frozen=True, slots=True)
class KnownServer:
    """A server, and how to open its socket."""

    name: str
    config: ServerConfig
    connect: SocketConnector

    @property
    def robot_id(self) -> str:
        return str(self.config.auth.robot_id)


@dataclass(frozen=True, slots=True)
class Introduction:
    """An operator's offer, which server brought it, and who sent it: ``sender`` is told apart from those of all
    servers, while ``start`` has the ids by which this one knows it."""

    start: StartPeer
    sender: Sender
    server: ServerLink


class IntroducedPeer(Protocol):
    """A peer, as the server that introduced it commands it."""

    def renegotiate(self, offer_sdp: str, tracks: Mapping[str, str] | None) -> None: ...
    def add_candidate(self, candidate: IceCandidate) -> None: ...
    def close(self, code: str, message: str = "") -> None: ...


class PeerStarter(Protocol):
    """Answers the operators that servers introduce, on the event loop."""

    def start_peer(self, introduction: Introduction) -> IntroducedPeer: ...


class ServerLink:
    """Keeps the session with one server, and carries out what it asks of the peers that it introduced. Event loop only.

    ``scope`` keeps its ids apart from those of other servers: ids that the robot goes by begin with it, and are never
    taken to pieces again. Toward the server a peer has the server's own id.
    """

    def __init__(
        self,
        server: KnownServer,
        catalogue: Catalogue,
        scope: str,
        peers: PeerStarter,
        state_changed: Callable[[], None],
    ) -> None:
        self.server = server
        self.state = "offline"
        """``connecting``, ``ready``, ``offline`` or ``stopped``."""
        self.error: SignalingError | None = None
        """The same robot connected elsewhere: this server wants no more of it."""
        self._scope = scope
        self._starter = peers
        self._state_changed = state_changed
        self._peers: dict[str, IntroducedPeer] = {}
        self._refusals = ComplaintPace(REFUSALS_TOLD_S)
        machine = RobotSignaling(_facts(server, catalogue), TicketVerifier(server.robot_id), random.random)
        url = f"{server.config.ws_url.rstrip('/')}/ws/robot"
        self._socket = SignalingSocket(url, machine, server.connect, self._carry_out)

    @property
    def is_on_this_machine(self) -> bool:
        return is_loopback_name(urlsplit(self.server.config.ws_url).hostname or "")

    @property
    def is_near(self) -> bool:
        """The robot serves it itself, on its own network."""
        return self.server.name == LAN

    async def run(self) -> None:
        """Until :meth:`shut_down`, or until the server has put the robot off for good."""
        await self._socket.run()

    def shut_down(self) -> None:
        """Say good-bye; :meth:`run` ends then."""
        self._socket.tell(events.ShutdownBegun())

    def catalogue_changed(self, catalogue: Catalogue) -> None:
        self._socket.tell(events.CatalogueChanged(catalogue))

    def network_changed(self, change: NetworkChange) -> None:
        """A socket of the network before may hang for long; one that is missing is worth a try now."""
        if change == "moved" or self.state != "ready":
            self._socket.renew()

    # -- what its peers tell, by the ids that it gave them -------------------------------------------------------

    def signal(self, message: SignalingMessage) -> None:
        self._socket.tell(events.MessageReady(message))

    def peer_connected(self, peer_id: str) -> None:
        self._socket.tell(events.PeerConnected(peer_id))

    def peer_ended(self, peer_id: str, peer: IntroducedPeer, code: str, message: str) -> None:
        if self._peers.get(peer_id) is peer:
            del self._peers[peer_id]
            self._socket.tell(events.PeerEnded(peer_id, code, message))

    # -- what it asks --------------------------------------------------------------------------------------------

    def _carry_out(self, effect: events.Effect) -> None:
        match effect:
            case StartPeer(peer_id=peer_id):
                self._peers[peer_id] = self._starter.start_peer(Introduction(effect, self._sender(effect), self))
            case RenegotiatePeer(peer_id, offer_sdp, tracks) if peer_id in self._peers:
                self._peers[peer_id].renegotiate(offer_sdp, tracks)
            case AddCandidate(peer_id, candidate) if peer_id in self._peers:
                self._peers[peer_id].add_candidate(candidate)
            case StopPeer(peer_id, code):
                # the session has forgotten it already: its end, told now, would end a new one under the same id
                peer = self._peers.pop(peer_id, None)
                if peer is not None:
                    peer.close(code)
            case RefusePeer(peer_id, code, message):
                fields = {"peerId": self._scope + peer_id, "code": code}
                level = logging.WARNING if self._refusals.is_due(code, time.monotonic()) else logging.DEBUG
                logger.log(level, "operator refused (%s): %s", code, message or reason(code).sentence, extra=fields)
            case events.ChangeState(state):
                self.state = state
                self._state_changed()
            case events.Report(code, message):
                self._report(code, f"{self.server.name} server: {message}" if self._scope else message)

    def _report(self, code: str, message: str) -> None:
        fields = {"robotId": self.server.robot_id, "code": code}
        if not code:
            logger.info("%s", message, extra=fields)
            return
        logger.error("%s (%s) %s", message, code, reason(code).cure, extra=fields)
        if code == "signal.replaced":
            self.error = SignalingError(message, code=code)

    def _sender(self, start: StartPeer) -> Sender:
        who, scope = start.identity, self._scope
        operator_id = scope + who.operator_id if who.operator_id else ""
        return Sender(scope + start.peer_id, scope + who.session_id, operator_id, who.name, who.role)


def _facts(server: KnownServer, catalogue: Catalogue) -> events.RobotFacts:
    auth = server.config.auth
    token = None
    if auth.type == "simple-token":
        token = auth.params.token.get_secret_value() if auth.params.token is not None else ""
    return events.RobotFacts(
        robot_id=server.robot_id, token=token, catalogue=catalogue, ice_servers=server.config.webrtc.ice_servers
    )


class RobotServers:
    """Keeps a link to every server of a robot: each may come and go, the robot goes on. Event loop only."""

    def __init__(
        self,
        servers: Sequence[KnownServer],
        catalogue: Catalogue,
        peers: PeerStarter,
        state_changed: Callable[[], None],
    ) -> None:
        scopes = [f"{one.name}:" if len(servers) > 1 else "" for one in servers]
        self.links = tuple(
            ServerLink(one, catalogue, scope, peers, state_changed) for one, scope in zip(servers, scopes, strict=True)
        )

    @property
    def state(self) -> str:
        """How the robot stands to the server to which it stands best."""
        return best_state([link.state for link in self.links])

    @property
    def error(self) -> SignalingError | None:
        """Why a server put the robot off for good; of several the last one's."""
        return next((link.error for link in reversed(self.links) if link.error is not None), None)

    async def run(self) -> None:
        """Until every server has put the robot off for good, or :meth:`shut_down`."""
        await asyncio.gather(*(link.run() for link in self.links))

    def shut_down(self) -> None:
        for link in self.links:
            link.shut_down()

    def catalogue_changed(self, catalogue: Catalogue) -> None:
        for link in self.links:
            link.catalogue_changed(catalogue)

    def network_changed(self, change: NetworkChange) -> None:
        for link in self.links:
            link.network_changed(change)

    def snapshot(self) -> tuple[ServerSnapshot, ...]:
        return tuple(ServerSnapshot(link.server.name, link.server.config.ws_url, link.state) for link in self.links)


def best_state(states: Sequence[str]) -> str:
    """Of several servers' states the best."""
    return next((one for one in ("ready", "connecting", "offline") if one in states), "stopped")
