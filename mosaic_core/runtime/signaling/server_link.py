"""One of the servers that introduce operators to a robot: its session, and ids that no other server's can be.

A robot may know several (its fleet's and the one that it runs itself). Each checks tickets with its own keys, and what
one says of a peer or an operator never touches those of another.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from mosaic_core.machines.peers.network_change import NetworkChange
from mosaic_core.machines.signaling import signaling_events as session
from mosaic_core.machines.signaling.peer_admission import AddCandidate, PeerIdentity, RefusePeer, StartPeer, StopPeer
from mosaic_core.machines.signaling.robot_signaling import RobotSignaling
from mosaic_core.runtime.signaling.signaling_socket import SignalingSocket
from mosaic_core.runtime.signaling.tickets import TicketVerifier
from mosaic_core.runtime.transport.transport import SocketConnector
from mosaic_core.words.catalogue import Catalogue
from mosaic_core.words.config import ServerConfig
from mosaic_core.words.signaling import (
    ClosePeerConnection,
    ExchangeIceCandidate,
    SdpAnswer,
    SignalingMessage,
)

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


class ServerLink:
    """Event loop only. ``carry_out`` gets what concerns the robot, with ids that begin with ``scope``."""

    def __init__(
        self,
        server: KnownServer,
        catalogue: Catalogue,
        scope: str,
        carry_out: Callable[[session.Effect], None],
    ) -> None:
        self.server = server
        self.scope = scope
        self.state = "offline"
        """``connecting``, ``ready``, ``offline`` or ``stopped``."""
        self._carry_out = carry_out
        machine = RobotSignaling(_facts(server, catalogue), TicketVerifier(server.robot_id))
        url = f"{server.config.ws_url.rstrip('/')}/ws/robot"
        self._client = SignalingSocket(url, machine, server.connect, self._take)

    async def run(self) -> None:
        """Until :meth:`shut_down`, or until the server has put the robot off for good."""
        await self._client.run()

    def shut_down(self) -> None:
        """Say good-bye; :meth:`run` ends then."""
        self._client.tell(session.ShutdownBegun())

    def network_changed(self, change: NetworkChange) -> None:
        """A socket of the network before may hang for long; one that is missing is worth a try now."""
        if change == "moved" or self.state != "ready":
            self._client.renew()

    def introduced(self, peer_id: str) -> bool:
        return peer_id.startswith(self.scope)

    def signal(self, message: SignalingMessage) -> None:
        """Something of a peer for the server that introduced it."""
        if isinstance(message, SdpAnswer | ExchangeIceCandidate | ClosePeerConnection):
            theirs = self._theirs(message.rtc_connection_id)
            message = message.model_copy(update={"rtc_connection_id": theirs})
        self._client.tell(session.MessageReady(message))

    def peer_connected(self, peer_id: str) -> None:
        self._client.tell(session.PeerConnected(self._theirs(peer_id)))

    def peer_ended(self, peer_id: str, code: str, message: str) -> None:
        self._client.tell(session.PeerEnded(self._theirs(peer_id), code, message))

    def _take(self, effect: session.Effect) -> None:
        if isinstance(effect, session.ChangeState):
            self.state = effect.state
        self._carry_out(self._scoped(effect))

    def _scoped(self, effect: session.Effect) -> session.Effect:
        match effect:
            case StartPeer(peer_id=peer_id, identity=who):
                return replace(effect, peer_id=self.scope + peer_id, identity=self._identity(who))
            case StopPeer(peer_id=peer_id) | AddCandidate(peer_id=peer_id) | RefusePeer(peer_id=peer_id):
                return replace(effect, peer_id=self.scope + peer_id)
            case session.Report(message=message) if self.scope:
                return replace(effect, message=f"{self.server.name} server: {message}")
        return effect

    def _identity(self, who: PeerIdentity) -> PeerIdentity:
        operator_id = self.scope + who.operator_id if who.operator_id else ""
        return replace(who, session_id=self.scope + who.session_id, operator_id=operator_id)

    def _theirs(self, peer_id: str) -> str:
        return peer_id.removeprefix(self.scope)


def _facts(server: KnownServer, catalogue: Catalogue) -> session.RobotFacts:
    auth = server.config.auth
    token = None
    if auth.type == "simple-token":
        token = auth.params.token.get_secret_value() if auth.params.token is not None else ""
    return session.RobotFacts(
        robot_id=server.robot_id, token=token, catalogue=catalogue, ice_servers=server.config.webrtc.ice_servers
    )


def best_state(states: list[str]) -> str:
    """How a robot stands that knows several servers: as it stands to the one where it stands best."""
    return next((one for one in ("ready", "connecting", "offline") if one in states), "stopped")
